uniform int brdf;             // 0 diffuse, 1 phong, 2 blinnphong
uniform int pairs;            // of directions, one from the map and one from the BRDF
uniform int stream;
uniform bool map_has_energy;
uniform sampler2D row_cdf;    // gpu.environment.GpuEnvironment.sampling
uniform sampler2D column_cdf;

vec3 shade_variance = vec3(0.0);  // of the returned mean

// Four uniform numbers in [0, 1) for a counter: pcg4d (Jarzynski, Olano 2020).
vec4 random(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
    return vec4(v >> 8u) * (1.0 / 16777216.0);
}

vec3 around(vec3 axis, float cosine, float phi) {
    float side = axis.z < 0.0 ? -1.0 : 1.0;
    float a = -1.0 / (side + axis.z), b = axis.x * axis.y * a;
    vec3 x = vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x);
    vec3 y = vec3(b, side + axis.y * axis.y * a, -axis.y);
    float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
    return normalize(sine * (cos(phi) * x + sin(phi) * y) + cosine * axis);
}

// Of cdf[0..n] in one row: the largest i with cdf[i] ≤ x. A cell of no weight is never found.
int find(sampler2D cdf, int row, int n, float x) {
    int low = 0, high = n;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (texelFetch(cdf, ivec2(middle, row), 0).r <= x) low = middle; else high = middle;
    }
    return low;
}

float weight_of(sampler2D cdf, int i, int row) {
    return texelFetch(cdf, ivec2(i + 1, row), 0).r - texelFetch(cdf, ivec2(i, row), 0).r;
}

// Density [1/sr] of a direction in a cell: uniform in u and v there. dω = 2π² sin θ du dv.
float map_density(ivec2 cell, float sin_theta) {
    ivec2 size = textureSize(env_latlong, 0);
    float weight = weight_of(row_cdf, cell.y, 0) * weight_of(column_cdf, cell.x, cell.y);
    return weight * float(size.x) * float(size.y - 1) / (2.0 * PI * PI * max(sin_theta, 1e-12));
}

float map_density(vec3 to_light) {
    if (!map_has_energy) return 0.0;
    ivec2 size = textureSize(env_latlong, 0);
    vec3 local = env_to_local * to_light;
    vec2 uv = direction_to_latlong(local);
    int column = int(floor(uv.x * float(size.x) - 0.5));
    int row = clamp(int(floor(uv.y * float(size.y - 1))), 0, size.y - 2);
    return map_density(ivec2(column < 0 ? column + size.x : min(column, size.x - 1), row), length(local.xz));
}

struct Lobes { vec3 n, v, r; float glossy; };  // glossy: chance of the glossy lobe in sampling

Lobes lobes_of(Surface s) {
    float matte = dot(diffuse_reflectance, vec3(1.0 / 3.0)), glossy = dot(specular_reflectance, vec3(1.0 / 3.0));
    float chance = brdf == 0 ? 0.0 : (matte + glossy > 0.0 ? glossy / (matte + glossy) : 1.0);
    return Lobes(s.normal, s.to_view, reflect(-s.to_view, s.normal), chance);
}

// BRDF × (n·l)₊; density is that of sample_lobes.
vec3 evaluate(Lobes s, vec3 l, out float density) {
    float n_l = max(dot(s.n, l), 0.0);
    vec3 value = diffuse_reflectance / PI * n_l;
    density = (1.0 - s.glossy) * n_l / PI;
    if (brdf == 1) {
        float r_l = max(dot(s.r, l), 0.0);
        float lobe = (exponent + 1.0) / (2.0 * PI) * (exponent == 0.0 ? float(r_l > 0.0) : pow(r_l, exponent));  // math.phong.phong_lobe
        density += s.glossy * lobe;
        if (n_l > 0.0) value += specular_reflectance * lobe;
    } else if (brdf == 2) {
        vec3 h = normalize(l + s.v);
        float h_n = max(dot(h, s.n), 0.0), power = exponent == 0.0 ? float(h_n > 0.0) : pow(h_n, exponent);
        density += s.glossy * (exponent + 1.0) / (2.0 * PI) * power / max(4.0 * dot(s.v, h), 1e-12);
        value += specular_reflectance * (exponent + 8.0) / (8.0 * PI) * power * n_l;  // math.phong.blinn_phong_brdf
    }
    return n_l > 0.0 ? value : vec3(0.0);
}

vec3 sample_lobes(Lobes s, vec4 u) {
    if (u.x >= s.glossy) return around(s.n, sqrt(u.y), 2.0 * PI * u.z);
    float cosine = pow(1.0 - u.y, 1.0 / (exponent + 1.0));  // 1 − u.y is never 0
    if (brdf == 1) return around(s.r, cosine, 2.0 * PI * u.z);
    vec3 h = around(s.n, cosine, 2.0 * PI * u.z);
    return reflect(-s.v, h);
}

vec3 from_map(Lobes s, vec4 u) {
    ivec2 size = textureSize(env_latlong, 0);
    int row = find(row_cdf, 0, size.y - 1, u.x);
    int column = find(column_cdf, row, size.x, u.y);
    float texture_u = (float(column) + 0.5 + u.z) / float(size.x), texture_v = (float(row) + u.w) / float(size.y - 1);
    float phi = 2.0 * PI * texture_u, theta = PI * texture_v, sin_theta = sin(theta);
    vec3 local = vec3(sin_theta * sin(phi), cos(theta), -sin_theta * cos(phi));
    float density;
    vec3 value = evaluate(s, transpose(env_to_local) * local, density);
    density += map_density(ivec2(column, row), sin_theta);
    return value == vec3(0.0) ? vec3(0.0) : value / density * env_radiance_at(texture_u - floor(texture_u), texture_v);
}

vec3 from_lobes(Lobes s, vec4 u) {
    vec3 l = sample_lobes(s, u);
    float density;
    vec3 value = evaluate(s, l, density);
    return value == vec3(0.0) ? vec3(0.0) : value / (density + map_density(l)) * env_radiance(l);
}

vec3 shade(Surface surface) {
    Lobes s = lobes_of(surface);
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    vec3 mean = vec3(0.0), squares = vec3(0.0);  // Welford's running mean and sum of squared deviations
    for (int i = 0; i < pairs; ++i) {
        vec3 value = from_lobes(s, random(uvec4(pixel, 2 * i, stream)));
        if (map_has_energy) value += from_map(s, random(uvec4(pixel, 2 * i + 1, stream)));
        vec3 step = value - mean;
        mean += step / float(i + 1);
        squares += step * (value - mean);
    }
    shade_variance = squares / (float(pairs) * float(pairs - 1));
    return mean;
}
