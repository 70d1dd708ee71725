// math.cube_tree.CubeTree: quadtrees over a cubemap in depth-first order, NODE_COLUMNS nodes a row.
uniform sampler2D node_direction_skip;      // unit centre of light; the next node after a node's own
uniform sampler2D node_energy_solid_angle;  // ∫ L dω; Ω
uniform int node_count;
uniform float opening;

struct Node {
    vec3 direction, energy;
    float solid_angle;
    int skip;
};

Node node_at(int i) {
    ivec2 place = ivec2(i % NODE_COLUMNS, i / NODE_COLUMNS);
    vec4 a = texelFetch(node_direction_skip, place, 0), b = texelFetch(node_energy_solid_angle, place, 0);
    return Node(a.xyz, b.rgb, b.a, int(a.w));
}

// Texels, whose next node is the very next one, cannot be opened.
bool opens(Node node, int i, float dist, float lobe_width) {
    float limit = opening * (dist + lobe_width);
    return node.skip > i + 1 && node.solid_angle > limit * limit;
}
