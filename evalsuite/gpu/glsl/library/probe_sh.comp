// math.sh.project_cube of one small level: nine sums over its texels, one invocation each. The products of basis function
// and solid angle come ready, in double precision.
layout(local_size_x = 9) in;
layout(rgba32f, binding = 0) readonly uniform imageCube faces;
layout(std430, binding = 0) readonly buffer Weights { float weights[]; };  // [face][row][column][basis function]
layout(std430, binding = 1) writeonly buffer Coefficients { vec4 sh[]; };

void main() {
    int width = imageSize(faces).x, basis = int(gl_LocalInvocationID.x);
    vec3 sum = vec3(0.0);
    for (int face = 0; face < 6; ++face) {
        vec3 part = vec3(0.0);  // partial sums: fewer float32 roundings
        for (int texel = 0; texel < width * width; ++texel) {
            float weight = weights[(face * width * width + texel) * 9 + basis];
            part += weight * imageLoad(faces, ivec3(texel % width, texel / width, face)).rgb;
        }
        sum += part;
    }
    sh[basis] = vec4(sum, 0.0);
}
