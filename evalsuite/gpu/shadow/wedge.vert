// The penumbra wedge of an edge: all points from which some of the edge lies within the light's disc. Six corners, eight
// triangles; the edge's lower end is raised to the height of the other, which only makes the wedge larger.
uniform mat4 world_to_clip;
uniform float tan_radius;
uniform float lowest;  // along to_light, of all that is lit
flat out vec3 edge_from;
flat out vec3 edge_to;
flat out vec4 plane_left;
flat out vec4 plane_right;
flat out float edge_closed;

// Corners: 0, 1 the raised edge; 2, 3 its ends moved to +n, 4, 5 to −n, far down. Counter-clockwise from outside.
const int CORNERS[24] = int[24](0, 2, 3, 0, 3, 1, 0, 1, 5, 0, 5, 4, 0, 4, 2, 1, 3, 5, 2, 4, 5, 2, 5, 3);

void main() {
    edge_from = in_from.xyz;
    edge_to = in_to.xyz;
    plane_left = in_left;
    plane_right = in_right;
    edge_closed = in_from.w;
    bool swap = dot(edge_to - edge_from, to_light) > 0.0;
    vec3 high = swap ? edge_to : edge_from, low = swap ? edge_from : edge_to;
    vec3 along = low - high;
    along -= to_light * dot(along, to_light);
    float extent = length(along);
    // An edge that points at the light covers nothing.
    if (extent < 1e-6 * length(edge_to - edge_from)) {
        gl_Position = vec4(0.0);
        return;
    }
    vec3 t = along / extent, n = cross(t, to_light);
    int corner = CORNERS[gl_VertexID];
    bool second = (corner & 1) == 1;
    vec3 place = second ? high + along : high;
    if (corner > 1) {
        vec3 outwards = (corner < 4 ? n : -n) + (second ? t : -t);
        float reach = dot(high, to_light) - lowest;
        place += reach * (tan_radius * outwards - to_light);
    }
    gl_Position = world_to_clip * vec4(place, 1.0);
}
