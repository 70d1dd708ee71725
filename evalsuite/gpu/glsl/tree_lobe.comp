// A cubemap filtered with one lobe round about each texel's direction, by its tree: math.radial_lobe.filter_tree.
layout(std430, binding = 0) readonly buffer Profile { float profile[]; };
uniform float lobe_width;

// math.radial_lobe.RadialLobe.__call__
float lobe(float chord) {
    float x = chord / (chord + lobe_width) * (2.0 + lobe_width) * 0.5 * float(profile.length() - 1);
    int i = min(int(x), profile.length() - 2);
    return mix(profile[i], profile[i + 1], x - float(i));
}

void main() {
    ivec3 texel = filter_texel();
    int width = imageSize(target).x;
    if (texel.x >= width || texel.y >= width) return;
    vec3 axis = filter_axis(texel, width), light = vec3(0.0);
    float whole = 0.0;
    for (int i = 0; i < node_count;) {
        Node node = node_at(i);
        float chord = distance(node.direction, axis);
        if (opens(node, i, chord, lobe_width)) { ++i; continue; }
        float p = lobe(chord);
        light += p * node.energy;
        whole += p * node.solid_angle;
        i = node.skip;
    }
    imageStore(target, texel, vec4(light / max(whole, 1e-30), 1.0));
}
