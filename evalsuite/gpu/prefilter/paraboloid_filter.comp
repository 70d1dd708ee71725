// One level of a paraboloid map × a kernel: math.hierarchical.filtered. One invocation a texel.
layout(local_size_x = 8, local_size_y = 8) in;
layout(rgba32f, binding = 0) writeonly uniform image2D result;
uniform sampler2D map;
uniform sampler2D weights;  // (2h + 1)², summing to 1
uniform int level;
uniform int first_row;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, first_row);
    int size = imageSize(result).x, half_width = textureSize(weights, 0).x / 2;
    if (texel.x >= size || texel.y >= size) return;
    vec3 sum = vec3(0.0);
    for (int j = -half_width; j <= half_width; ++j) {
        vec3 row = vec3(0.0);
        for (int i = -half_width; i <= half_width; ++i) {
            float weight = texelFetch(weights, ivec2(i, j) + half_width, 0).r;
            if (weight == 0.0) continue;
            row += weight * texelFetch(map, clamp(texel + ivec2(i, j), 0, size - 1), level).rgb;
        }
        sum += row;
    }
    imageStore(result, texel, vec4(sum, 1.0));
}
