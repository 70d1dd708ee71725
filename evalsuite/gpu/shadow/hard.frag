// Counts the layers of occluders between p and the light's centre: ±1 where the view ray crosses a side of a shadow volume
// before it reaches p. That is asked of p itself, not of the depth buffer, in the words in which the wedge pass asks it.
flat in vec3 edge_from;
flat in vec3 edge_to;
flat in vec2 edge_outline;
uniform sampler2D positions;
uniform vec3 camera_position;
layout(location = 0) out vec2 out_layers;

void main() {
    vec4 p = texelFetch(positions, ivec2(gl_FragCoord.xy), 0);
    if (p.w == 0.0) discard;
    float crossed = left_side(p.xyz, edge_from, edge_to) - left_side(camera_position, edge_from, edge_to);
    if (crossed == 0.0) discard;
    out_layers = crossed * edge_outline;
}
