// One level of a MIP chain: 2 × 2 means weighted by the texels' solid angles, math.paraboloid.weighted_mips.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
layout(rgba32f, binding = 0) readonly uniform image2D finer;
layout(rgba32f, binding = 1) writeonly uniform image2D coarser;
uniform sampler2D weights;  // of the finer level
uniform int marked;         // as in resample_disc.comp, for the coarser level

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    int size = imageSize(coarser).x;
    if (texel.x >= size || texel.y >= size) return;
    vec3 sum = vec3(0.0);
    float weight = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 child = 2 * texel + ivec2(i & 1, i >> 1);
        float w = texelFetch(weights, child, 0).r;
        sum += w * imageLoad(finer, child).rgb;
        weight += w;
    }
    ivec2 doubled = 2 * texel + 1 - size;
    imageStore(coarser, texel, vec4(sum / weight, doubled.x * doubled.x + doubled.y * doubled.y <= marked ? 1.0 : 0.0));
}
