// A map gathered on a grid × a cosine-power lobe: math.lobe_grid, Σ_c Φ_c K(r·l_c) at each node r. One invocation a node.
layout(local_size_x = 64) in;
layout(rgba32f, binding = 0) writeonly uniform image2D sums;
uniform sampler2D power;       // Φ, (R, 2R)
uniform sampler2D haversine;   // sin²(π d / 2R) for d = 0 … R columns apart
uniform float exponent;
uniform float reach;           // 1 − cos of the angle where the lobe ends
uniform int reach_rows;
uniform int first_row;

const float PI = 3.14159265358979323846;

// log(1 − u) without the digits that 1 − u loses.
float log_cosine(float u) {
    return u < 0.03 ? -u * (1.0 + u * (1.0 / 2.0 + u * (1.0 / 3.0 + u * (0.25 + 0.2 * u)))) : log(max(1.0 - u, 1e-30));
}

// math.phong.phong_lobe before its normalisation, of u = 1 − cos.
float lobe(float u) {
    if (u >= 1.0) return 0.0;
    return exponent == 1.0 ? 1.0 - u : exp(exponent * log_cosine(u));
}

void main() {
    ivec2 size = textureSize(power, 0), node = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, first_row);
    if (node.x >= size.x || node.y >= size.y) return;
    int half_turn = size.x / 2;
    float theta = PI * (float(node.y) + 0.5) / float(size.y);
    vec3 sum = vec3(0.0);
    for (int row = max(0, node.y - reach_rows); row <= min(size.y - 1, node.y + reach_rows); ++row) {
        float other = PI * (float(row) + 0.5) / float(size.y);
        float half_sine = sin(0.5 * (theta - other));
        // 1 − cos of the angle between: haversine formula, exact for small angles.
        float here = 2.0 * half_sine * half_sine, across = 2.0 * sin(theta) * sin(other);
        float widest = (reach - here) / across;
        if (widest < 0.0) continue;
        int last = widest >= 1.0 ? half_turn : int(float(size.x) / PI * atan(sqrt(widest), sqrt(1.0 - widest))) + 1;
        last = min(last, half_turn);
        vec3 part = lobe(here) * texelFetch(power, ivec2(node.x, row), 0).rgb;
        for (int d = 1; d <= last; ++d) {
            int left = node.x - d, right = node.x + d;
            left = left < 0 ? left + size.x : left;
            right = right >= size.x ? right - size.x : right;
            vec3 both = texelFetch(power, ivec2(left, row), 0).rgb;
            if (d < half_turn) both += texelFetch(power, ivec2(right, row), 0).rgb;  // half a turn away they are one
            part += lobe(here + across * texelFetch(haversine, ivec2(d, 0), 0).r) * both;
        }
        sum += part;
    }
    imageStore(sums, node, vec4((exponent + 1.0) / (2.0 * PI) * sum, 1.0));
}
