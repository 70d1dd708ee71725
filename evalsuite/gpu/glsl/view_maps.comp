// Radiance sphere maps of a rough conductor seen from fixed views: math.view_maps.radiance. One invocation a texel, z the view.
// After fresnel.glsl and library/cube_tree.glsl.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
layout(rgba32f, binding = 0) writeonly uniform image2DArray target;
uniform mat3 frames[VIEWS];  // right, up, v_i
uniform int first_row;
uniform float alpha;
uniform bool beckmann;
uniform vec3 eta;
uniform vec3 k;
uniform vec3 albedo[ALBEDOS];  // at n·v = (i/(ALBEDOS − 1))²

// math.microfacet.normal_density without its constant factor.
float normal_density(float c) {
    if (c <= 0.0) return 0.0;
    float c2 = c * c;
    if (beckmann) return exp(-(1.0 / c2 - 1.0) / (alpha * alpha)) / (c2 * c2);
    float d = (alpha * alpha - 1.0) * c2 + 1.0;
    return 1.0 / (d * d);
}

// math.microfacet.smith_g1
float smith_g1(float c) {
    if (c <= 0.0) return 0.0;
    float sine = sqrt(max(1.0 - c * c, 0.0));
    if (!beckmann) return 2.0 * c / (c + sqrt(c * c + alpha * alpha * sine * sine));
    float a = min(c / max(alpha * sine, 1e-9), 2.0);
    return a < 1.6 ? (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a) : 1.0;
}

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID) + ivec3(0, first_row, 0);
    int width = imageSize(target).x;
    if (texel.x >= width || texel.y >= width) return;
    // math.view_maps.texel_normals
    vec2 disc = (vec2(texel.xy) + 0.5 - 0.5 * float(width)) / (0.5 * float(width) - 1.0);
    disc *= min(1.0, MAX_RADIUS / max(length(disc), 1e-9));
    vec3 v = frames[texel.z][2], n = frames[texel.z] * vec3(disc, sqrt(1.0 - dot(disc, disc)));
    float n_v = dot(n, v);
    vec3 r = reflect(-v, n), light = vec3(0.0), whole = vec3(0.0);
    float lobe_width = min(2.0 * alpha * max(n_v, 0.3), 0.5);
    for (int i = 0; i < node_count;) {
        Node node = node_at(i);
        if (opens(node, i, distance(node.direction, r), lobe_width)) { ++i; continue; }
        vec3 h = normalize(node.direction + v);
        vec3 p = normal_density(dot(n, h)) * smith_g1(dot(n, node.direction)) * fresnel_conductor(dot(v, h), eta, k);
        light += p * node.energy;
        whole += p * node.solid_angle;
        i = node.skip;
    }
    float position = sqrt(n_v) * float(ALBEDOS - 1);
    int i = min(int(position), ALBEDOS - 2);
    light *= mix(albedo[i], albedo[i + 1], position - float(i)) / max(whole, vec3(1e-30));
    imageStore(target, texel, vec4(light, 1.0));
}
