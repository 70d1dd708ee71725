// Lat-long environment → dual paraboloid maps (math.paraboloid.resample) or, with SPHERE_MAP, a sphere map
// (math.sphere_map.resample). One invocation a texel; z is the hemisphere.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
layout(rgba32f, binding = 0) writeonly uniform image2D front;
#ifdef SPHERE_MAP
uniform isampler2D counts;       // sub-samples a side, a texel
#else
layout(rgba32f, binding = 1) writeonly uniform image2D back;
uniform int subsamples;
#endif
uniform mat3 map_to_world;
uniform float radius;            // of the circle [texels]
uniform int marked;              // alpha is 1 where (2i + 1 − n)² + (2j + 1 − n)² ≤ marked: math.disc_map.circle_limit
uniform int first_row;

#ifdef SPHERE_MAP
// math.sphere_map.disc_to_direction
vec3 to_direction(vec2 p, int half_) {
    float squared = min(dot(p, p), 1.0);
    return vec3(2.0 * sqrt(1.0 - squared) * p, 1.0 - 2.0 * squared);
}
// How much of the sub-sample's own cell lies in the disc.
float weigh(vec2 p, int k) { return clamp(0.5 + (1.0 - length(p)) * radius * float(k), 0.0, 1.0); }
#else
// math.paraboloid.paraboloid_to_direction, up to a positive factor
vec3 to_direction(vec2 p, int half_) {
    float z = 1.0 - dot(p, p);
    return vec3(2.0 * p, half_ == 0 ? z : -z);
}
float weigh(vec2 p, int k) { float q = 1.0 + dot(p, p); return 1.0 / (q * q); }
#endif

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID) + ivec3(0, first_row, 0);
    int size = imageSize(front).x;
    if (texel.x >= size || texel.y >= size) return;
#ifdef SPHERE_MAP
    int subsamples = texelFetch(counts, texel.xy, 0).r;
#endif
    vec3 sum = vec3(0.0);
    float weight = 0.0;
    for (int j = 0; j < subsamples; ++j) {
        vec3 row = vec3(0.0);  // partial sums: fewer float32 roundings
        for (int i = 0; i < subsamples; ++i) {
            vec2 p = (vec2(texel.xy) + (vec2(i, j) + 0.5) / float(subsamples) - 0.5 * float(size)) / radius;
            float omega = weigh(p, subsamples);
            if (omega <= 0.0) continue;
            row += omega * env_radiance(map_to_world * to_direction(p, texel.z));
            weight += omega;
        }
        sum += row;
    }
    vec3 mean = weight > 0.0 ? sum / weight : env_radiance(map_to_world * vec3(0.0, 0.0, -1.0));
    ivec2 doubled = 2 * texel.xy + 1 - size;
    vec4 value = vec4(mean, doubled.x * doubled.x + doubled.y * doubled.y <= marked ? 1.0 : 0.0);
#ifdef SPHERE_MAP
    imageStore(front, texel.xy, value);
#else
    if (texel.z == 0) imageStore(front, texel.xy, value); else imageStore(back, texel.xy, value);
#endif
}
