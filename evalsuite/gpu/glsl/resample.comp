// Lat-long environment → level 0 of a cubemap: math.cubemap.resample_latlong. One invocation a texel.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
layout(rgba32f, binding = 0) writeonly uniform imageCube faces;
uniform int subsamples;
uniform int first_row;

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID) + ivec3(0, first_row, 0);
    int width = imageSize(faces).x;
    if (texel.x >= width || texel.y >= width) return;
    vec3 sum = vec3(0.0);
    float weight = 0.0;
    for (int j = 0; j < subsamples; ++j) {
        vec3 row = vec3(0.0);  // partial sums: fewer float32 roundings
        for (int i = 0; i < subsamples; ++i) {
            vec2 ab = 2.0 * (vec2(texel.xy) + (vec2(i, j) + 0.5) / float(subsamples)) / float(width) - 1.0;
            float omega = pow(1.0 + dot(ab, ab), -1.5);
            row += omega * env_radiance(face_direction(texel.z, ab));
            weight += omega;
        }
        sum += row;
    }
    imageStore(faces, texel, vec4(sum / weight, 1.0));
}
