// One record an edge, the instance attributes of edge.glsl: its ends, and the planes of the triangles on both sides.
layout(local_size_x = 64) in;
struct Edge { vec4 from; vec4 to; vec4 left; vec4 right; };
layout(std430, binding = 0) readonly buffer Positions { vec4 position[]; };
layout(std430, binding = 2) readonly buffer Planes { vec4 plane[]; };
layout(std430, binding = 3) readonly buffer Adjacency { ivec4 adjacency[]; };  // from, to, left, right (−1: open)
layout(std430, binding = 4) writeonly buffer Edges { Edge edge[]; };
uniform int edges;

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= edges) return;
    ivec4 a = adjacency[index];
    // w of `from`: 1 where there is a triangle on the right.
    edge[index] = Edge(
        vec4(position[a.x].xyz, a.w >= 0 ? 1.0 : 0.0), vec4(position[a.y].xyz, 0.0), plane[a.z], a.w >= 0 ? plane[a.w] : vec4(0.0)
    );
}
