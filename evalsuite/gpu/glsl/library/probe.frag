// Radiance of the room towards the probe: diffuse surfaces, so it depends on the place alone. LIT_HERE: formed from the
// lamps in this very frame, without shadows and interreflection; else as it was baked.
flat in int v_triangle;
in vec2 v_weights;
in vec3 v_position;
layout(std430, binding = 0) readonly buffer Triangles { ivec2 lattice[]; };  // first sample, divisions
layout(std430, binding = 1) readonly buffer Radiance { vec4 radiance[]; };   // LIT_HERE: emission alone
layout(location = 0) out vec4 out_radiance;
#ifdef LIT_HERE
layout(std430, binding = 2) readonly buffer Reflectance { vec4 reflectance[]; };
layout(std430, binding = 3) readonly buffer Normals { vec4 normal[]; };      // of the triangles
layout(std430, binding = 4) readonly buffer Lamps { vec4 lamp[]; };          // each: three corners and its radiance
uniform int lamps;
#endif

// math.mesh_colors.lookup: three samples and their weights.
void samples_at(out ivec3 at, out vec3 weight) {
    int first = lattice[v_triangle].x, n = lattice[v_triangle].y;
    vec2 xy = clamp(v_weights, 0.0, 1.0) * float(n);
    int i = min(int(xy.x), n - 1), j = min(int(xy.y), n - 1 - i);
    vec2 f = xy - vec2(i, j);
    int here = first + j * (n + 1) - j * (j - 1) / 2 + i, above = here + n + 1 - j;  // (i, j) and (i, j + 1)
    bool below = f.x + f.y <= 1.0 || i + j >= n - 1;
    at = below ? ivec3(here, here + 1, above) : ivec3(above + 1, above, here + 1);
    weight = below ? vec3(1.0 - f.x - f.y, f) : vec3(f.x + f.y - 1.0, 1.0 - f);
}

#ifdef LIT_HERE
// One edge of Lambert's formula, n · Θ (a × b)/|a × b|; atan of two arguments, as acos loses digits.
float edge(vec3 a, vec3 b, vec3 n) {
    vec3 across = cross(a, b);
    float sine = length(across);
    return sine > 0.0 ? atan(sine, dot(a, b)) * dot(n, across) / sine : 0.0;
}

// math.polygon.form_factor: a triangle, relative to the point, clipped at the horizon.
float form_factor(vec3 corner[3], vec3 n) {
    vec3 start = vec3(0.0), last = vec3(0.0);
    bool any = false;
    float sum = 0.0;
    for (int k = 0; k < 3; ++k) {
        vec3 a = corner[k], b = corner[(k + 1) % 3];
        float ha = dot(a, n), hb = dot(b, n);
        if (ha > 0.0) {
            vec3 v = normalize(a);
            if (any) sum += edge(last, v, n); else start = v;
            last = v;
            any = true;
        }
        if ((ha > 0.0) != (hb > 0.0)) {
            vec3 v = normalize(a + ha / (ha - hb) * (b - a));
            if (any) sum += edge(last, v, n); else start = v;
            last = v;
            any = true;
        }
    }
    return any ? 0.5 * abs(sum + edge(last, start, n)) : 0.0;
}
#endif

void main() {
    ivec3 at;
    vec3 w;
    samples_at(at, w);
    vec3 sum = w.x * radiance[at.x].rgb + w.y * radiance[at.y].rgb + w.z * radiance[at.z].rgb;
#ifdef LIT_HERE
    vec3 irradiance = vec3(0.0), n = normal[v_triangle].xyz;
    for (int l = 0; l < lamps; ++l) {
        vec3 a = lamp[4 * l].xyz - v_position, b = lamp[4 * l + 1].xyz - v_position, c = lamp[4 * l + 2].xyz - v_position;
        if (dot(cross(b - a, c - a), a) >= 0.0) continue;  // its dark side
        irradiance += lamp[4 * l + 3].rgb * form_factor(vec3[3](a, b, c), n);
    }
    vec3 albedo = w.x * reflectance[at.x].rgb + w.y * reflectance[at.y].rgb + w.z * reflectance[at.z].rgb;
    sum += albedo / 3.14159265358979323846 * irradiance;
#endif
    out_radiance = vec4(sum, 1.0);
}
