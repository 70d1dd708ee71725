// The side of a shadow volume: from a silhouette edge to infinity, a triangle whose third corner is the direction away from
// the light.
uniform mat4 world_to_clip;
flat out vec3 edge_from;
flat out vec3 edge_to;
flat out vec2 edge_outline;

invariant gl_Position;

void main() {
    edge_from = in_from.xyz;
    edge_to = in_to.xyz;
    edge_outline = outline(dot(in_left.xyz, to_light) > 0.0, dot(in_right.xyz, to_light) > 0.0, in_from.w > 0.5);
    vec4 corner = gl_VertexID == 0 ? vec4(edge_from, 1.0) : gl_VertexID == 1 ? vec4(edge_to, 1.0) : vec4(-to_light, 0.0);
    gl_Position = edge_outline == vec2(0.0) ? vec4(0.0) : world_to_clip * corner;
}
