// What an edge adds to the light's covered part beyond the hard shadow's 0 or 1, seen from p: minus the sliver between the
// edge and the rim, math.disc_coverage.segment_sliver.
flat in vec3 edge_from;
flat in vec3 edge_to;
flat in vec4 plane_left;
flat in vec4 plane_right;
flat in float edge_closed;
uniform sampler2D positions;
uniform float tan_radius;
uniform float shortest;  // heights below it count as below: nothing there is seen in the light's direction
uniform float coplanar;  // distances from a plane below it count as none
layout(location = 0) out vec2 out_covered;

const float TWO_PI = 6.28318530717958647692;

void main() {
    vec3 p = texelFetch(positions, ivec2(gl_FragCoord.xy), 0).xyz;
    vec3 u = edge_from - p, v = edge_to - p;
    bool closed = edge_closed > 0.5;
    float height = dot(plane_left.xyz, p) + plane_left.w;
    // A receiver that lies in an open sheet is not covered by it.
    if (!closed && abs(height) < coplanar) discard;
#ifdef CENTRE
    bool left = dot(plane_left.xyz, to_light) > 0.0, right = dot(plane_right.xyz, to_light) > 0.0;
#else
    // Where the edge is before the light, facing the light is being turned away from p. A triangle that p lies on is not: its
    // edges are then the horizon below which its own mesh covers the light.
    bool left = height < -coplanar, right = dot(plane_right.xyz, p) + plane_right.w < -coplanar;
#endif
    vec2 weight = outline(left, right, closed);
    if (weight == vec2(0.0)) discard;
    float hu = dot(u, to_light), hv = dot(v, to_light);
    if (max(hu, hv) <= shortest) discard;
    vec3 a3 = hu < shortest ? mix(u, v, (shortest - hu) / (hv - hu)) : u;
    vec3 b3 = hv < shortest ? mix(v, u, (shortest - hv) / (hu - hv)) : v;
    vec2 a = vec2(dot(a3, tangent), dot(a3, bitangent)) / (max(hu, shortest) * tan_radius);
    vec2 b = vec2(dot(b3, tangent), dot(b3, bitangent)) / (max(hv, shortest) * tan_radius);
    vec2 d = b - a;
    float side = a.x * b.y - a.y * b.x, length2 = dot(d, d), root = length2 - side * side;
    if (root <= 0.0) discard;
    root = sqrt(root);
    float middle = -dot(a, d);
    float first = clamp((middle - root) / length2, 0.0, 1.0), last = clamp((middle + root) / length2, 0.0, 1.0);
    if (first >= last) discard;
    vec2 q = a + first * d, r = a + last * d;
    float sine = abs(side) * (last - first);  // |q × r|
    float sliver = (atan(sine, dot(q, r)) - sine) / TWO_PI;
    if (left_side(p, edge_from, edge_to) == 0.0) sliver = -sliver;
    out_covered = -sliver * weight;
}
