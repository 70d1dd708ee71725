// A triangle into its light's map. Depth is that of its plane at each texel's centre, not interpolated between corners that the
// rasteriser has moved to a grid: a receiver in the same plane then meets it to float32's precision.
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

uniform vec4 map_across[LAYERS];  // world → texels, gpu.shadow.maps.Fit
uniform vec4 map_up[LAYERS];
uniform vec3 map_to_light[LAYERS];
uniform float map_size;

in vec3 v_position[];
in vec3 v_support[];
flat in int v_layer[];
flat out vec2 g_corner;
flat out vec3 g_plane;  // depth at g_corner, and how it grows across and up [per texel]
flat out vec2 g_range;

void main() {
    int layer = v_layer[0];
    vec3 to_light = map_to_light[layer];
    // With the whole scene on the light's side of its plane it hides nothing.
    if (dot(v_support[0], to_light) > 0.0) return;
    vec2 at[3];
    float depth[3];
    for (int k = 0; k < 3; ++k) {
        vec4 p = vec4(v_position[k], 1.0);
        at[k] = vec2(dot(map_across[layer], p), dot(map_up[layer], p));
        depth[k] = -dot(to_light, v_position[k]);
    }
    vec2 a = at[1] - at[0], b = at[2] - at[0];
    float area = a.x * b.y - a.y * b.x;
    if (area == 0.0) return;
    vec2 rise = vec2(depth[1] - depth[0], depth[2] - depth[0]);
    vec3 plane = vec3(depth[0], vec2(rise.x * b.y - rise.y * a.y, rise.y * a.x - rise.x * b.x) / area);
    vec2 range = vec2(min(depth[0], min(depth[1], depth[2])), max(depth[0], max(depth[1], depth[2])));
    for (int k = 0; k < 3; ++k) {
        gl_Layer = layer;
        gl_Position = vec4(2.0 * at[k] / map_size - 1.0, 0.0, 1.0);
        g_corner = at[0];
        g_plane = plane;
        g_range = range;
        EmitVertex();
    }
    EndPrimitive();
}
