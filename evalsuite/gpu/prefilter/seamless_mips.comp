// One level of a cubemap's chain, filtered across faces and weighted by solid angle: math.seamless_mips.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
layout(rgba32f, binding = 0) readonly uniform imageCube finer;
layout(rgba32f, binding = 1) writeonly uniform imageCube coarser;
uniform sampler2D solid_angles;  // of a finer face's texels

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    int width = imageSize(finer).x;
    if (texel.x >= width / 2 || texel.y >= width / 2) return;
    vec3 sum = vec3(0.0);
    float total = 0.0;
    for (int j = -1; j <= 2; ++j) {
        for (int i = -1; i <= 2; ++i) {
            ivec2 at = 2 * texel.xy + ivec2(i, j);
            bvec2 outside = bvec2(at.x < 0 || at.x >= width, at.y < 0 || at.y >= width);
            if (all(outside)) continue;  // three texels meet at a cube's corner, not four
            ivec3 from = ivec3(at, texel.z);
            if (any(outside)) from = face_texel(face_direction(texel.z, (2.0 * vec2(at) + 1.0) / float(width) - 1.0), width);
            float weight = (i == 0 || i == 1 ? 3.0 : 1.0) * (j == 0 || j == 1 ? 3.0 : 1.0) * texelFetch(solid_angles, from.xy, 0).r;
            sum += weight * imageLoad(finer, from).rgb;
            total += weight;
        }
    }
    imageStore(coarser, texel, vec4(sum / total, 1.0));
}
