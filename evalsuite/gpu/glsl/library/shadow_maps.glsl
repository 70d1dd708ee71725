// A batch of gpu.shadow.maps.ShadowMaps.
#if BATCH > 0
uniform sampler2DArray map_depths;  // −l·p of what the light meets first; infinite where it meets nothing
uniform vec3 map_to_light[BATCH];   // world, unit
uniform vec4 map_across[BATCH];     // world → texels
uniform vec4 map_up[BATCH];
uniform vec2 map_texel[BATCH];      // width and height, in units of the scene
uniform float map_nearest[BATCH];   // least depth of a caster
uniform float map_size;             // [texels]
uniform float map_rounding;         // of depths, times the slope
#endif

// Unit normal of the triangle itself; call it where all four pixels of a quad do. Seen edge-on, a quad reaches past the plane's
// horizon and its differences mean nothing: there it is the shading normal.
vec3 geometric_normal(Surface s) {
    vec3 normal = normalize(cross(dFdx(s.position), dFdy(s.position)));
    return abs(dot(normal, s.to_view)) > 0.02 ? normal : s.normal;
}

#if BATCH > 0
// A surface point in one map: its place, its depth less what rounding may add, and how its plane's depth grows [per texel].
struct Receiver {
    vec2 at;
    float depth;
    vec2 slope;
};

Receiver receiver(int i, vec3 position, vec3 plane) {
    vec4 p = vec4(position, 1.0);
    vec2 at = vec2(dot(map_across[i], p), dot(map_up[i], p));
    // In the plane, moving by x along the map's unit axis X changes depth by x (plane·X)/(plane·l).
    float facing = dot(plane, map_to_light[i]);
    facing = facing < 0.0 ? min(facing, -1e-3) : max(facing, 1e-3);
    vec2 slope = vec2(dot(plane, map_across[i].xyz), dot(plane, map_up[i].xyz)) * map_texel[i] * map_texel[i] / facing;
    return Receiver(at, -dot(map_to_light[i], position) - map_rounding / abs(facing), slope);
}

// Depth of what the light meets first in the texel about `at`, where that is before the receiver's plane; infinite elsewhere.
float blocker(int i, Receiver r, vec2 at) {
    vec2 texel = floor(at);
    if (min(texel.x, texel.y) < 0.0 || max(texel.x, texel.y) >= map_size) return 1e30;
    float depth = texelFetch(map_depths, ivec3(texel, i), 0).r;
    return depth < r.depth + dot(r.slope, texel + 0.5 - r.at) ? depth : 1e30;
}
#endif
