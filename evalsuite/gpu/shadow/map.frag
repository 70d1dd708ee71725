flat in vec2 g_corner;
flat in vec3 g_plane;
flat in vec2 g_range;
layout(location = 0) out float out_depth;

void main() {
    float depth = g_plane.x + dot(g_plane.yz, gl_FragCoord.xy - g_corner);
    out_depth = clamp(depth, g_range.x, g_range.y);
}
