// (1 − d²) S + d² L, both magnified bilinearly: math.hierarchical.prefilter. One invocation a texel.
layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32f, binding = 0) writeonly uniform image2D result;
uniform sampler2D small;
uniform sampler2D large;
uniform float circle;  // radius [texels]

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    int size = imageSize(result).x;
    if (texel.x >= size || texel.y >= size) return;
    vec2 p = (vec2(texel) + 0.5 - 0.5 * float(size)) / circle, st = (vec2(texel) + 0.5) / float(size);
    vec3 blended = mix(textureLod(small, st, 0.0).rgb, textureLod(large, st, 0.0).rgb, min(dot(p, p), 1.0));
    imageStore(result, texel, vec4(blended, 1.0));
}
