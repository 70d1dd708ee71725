// The edges that can be outlines for some point of the light, as instances for edge.glsl, in their own order: one workgroup
// counts, sums up and writes, so that a picture is the same in every run.
layout(local_size_x = 1024) in;
struct Edge { vec4 from; vec4 to; vec4 left; vec4 right; };
layout(std430, binding = 0) readonly buffer Positions { vec4 position[]; };
layout(std430, binding = 2) readonly buffer Planes { vec4 plane[]; };
layout(std430, binding = 3) readonly buffer Adjacency { ivec4 adjacency[]; };  // from, to, left, right (−1: open)
layout(std430, binding = 4) writeonly buffer Edges { Edge edge[]; };
layout(std430, binding = 5) writeonly buffer Commands { uint command[10]; };  // of two indirect draws: sides and wedges
uniform int edges;
uniform vec3 to_light;
uniform float sin_radius;
shared uint count[1024];

bool turns(vec3 normal, bool up) {
    float height = dot(normal, to_light);
#ifdef CENTRE
    return up ? height > 0.0 : height <= 0.0;
#else
    return up ? height > -sin_radius : height < sin_radius;  // for some point of the light
#endif
}

bool silhouette(int index) {
    ivec4 a = adjacency[index];
    if (a.w < 0) return true;
    vec3 left = plane[a.z].xyz, right = plane[a.w].xyz;
    return (turns(left, true) && turns(right, false)) || (turns(left, false) && turns(right, true));
}

void main() {
    int me = int(gl_LocalInvocationID.x), share = (edges + 1023) / 1024;
    int first = me * share, last = min(first + share, edges);
    uint own = 0u;
    for (int i = first; i < last; ++i) own += silhouette(i) ? 1u : 0u;
    count[me] = own;
    barrier();
    for (int reach = 1; reach < 1024; reach *= 2) {
        uint before = me >= reach ? count[me - reach] : 0u;
        barrier();
        count[me] += before;
        barrier();
    }
    uint place = count[me] - own;
    for (int i = first; i < last; ++i) {
        if (!silhouette(i)) continue;
        ivec4 a = adjacency[i];
        // w of `from`: 1 where there is a triangle on the right.
        edge[place++] = Edge(
            vec4(position[a.x].xyz, a.w >= 0 ? 1.0 : 0.0), vec4(position[a.y].xyz, 0.0), plane[a.z],
            a.w >= 0 ? plane[a.w] : vec4(0.0)
        );
    }
    if (me == 1023)
        for (int draw = 0; draw < 2; ++draw) {
            command[5 * draw] = draw == 0 ? 3u : 24u;  // vertices
            command[5 * draw + 1] = count[1023];
            command[5 * draw + 2] = command[5 * draw + 3] = command[5 * draw + 4] = 0u;
        }
}
