// Tiles as probe.vert drew them → level 0 of a cubemap: means over solid angle.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
layout(rgba32f, binding = 0) writeonly uniform imageCube faces;
uniform sampler2D drawn;
uniform int subsamples;

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    int width = imageSize(faces).x;
    if (texel.x >= width || texel.y >= width) return;
    vec4 sum = vec4(0.0);
    float weight = 0.0;
    for (int j = 0; j < subsamples; ++j) {
        for (int i = 0; i < subsamples; ++i) {
            vec2 ab = 2.0 * (vec2(texel.xy) + subsample_offset(j * subsamples + i, subsamples)) / float(width) - 1.0;
            float omega = pow(1.0 + dot(ab, ab), -1.5);
            sum += omega * texelFetch(drawn, texel.xy + width * ivec2(i, texel.z * subsamples + j), 0);
            weight += omega;
        }
    }
    imageStore(faces, texel, sum / weight);  // alpha: how much of the texel the room fills
}
