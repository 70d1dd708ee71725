// Sums at a grid's nodes → a cubemap, by six-point interpolation along θ and φ: math.lobe_grid.lagrange. One invocation a texel.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
layout(rgba32f, binding = 0) writeonly uniform imageCube faces;
uniform sampler2D sums;

void lagrange(float t, out float w[6]) {
    float a = t + 2.0, b = t + 1.0, c = t, d = t - 1.0, e = t - 2.0, f = t - 3.0;
    w[0] = -b * c * d * e * f / 120.0;
    w[1] = a * c * d * e * f / 24.0;
    w[2] = -a * b * d * e * f / 12.0;
    w[3] = a * b * c * e * f / 12.0;
    w[4] = -a * b * c * d * f / 24.0;
    w[5] = a * b * c * d * e / 120.0;
}

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    int width = imageSize(faces).x;
    if (texel.x >= width || texel.y >= width) return;
    vec2 ab = (2.0 * vec2(texel.xy) + 1.0) / float(width) - 1.0;
    ivec2 size = textureSize(sums, 0);
    vec2 position = direction_to_latlong(env_to_local * face_direction(texel.z, ab)) * vec2(size) - 0.5;
    ivec2 low = ivec2(floor(position));
    float across[6], down[6];
    lagrange(position.x - float(low.x), across);
    lagrange(position.y - float(low.y), down);
    vec3 value = vec3(0.0);
    for (int j = 0; j < 6; ++j) {
        int row = low.y - 2 + j, first = low.x - 2 + size.x;
        if (row < 0 || row >= size.y) {  // beyond a pole: half a turn round
            row = row < 0 ? -1 - row : 2 * size.y - 1 - row;
            first += size.x / 2;
        }
        vec3 part = vec3(0.0);
        for (int i = 0; i < 6; ++i) {
            int column = first + i;
            column -= column >= 2 * size.x ? 2 * size.x : (column >= size.x ? size.x : 0);
            part += across[i] * texelFetch(sums, ivec2(column, row), 0).rgb;
        }
        value += down[j] * part;
    }
    imageStore(faces, texel, vec4(value, 1.0));
}
