// Casters, once for each light of a batch.
in vec3 in_position;
in vec3 in_support;
out vec3 v_position;
out vec3 v_support;  // normal towards the side of the triangle's plane on which the whole scene lies, 0 without one
flat out int v_layer;

void main() {
    v_position = in_position;
    v_support = in_support;
    v_layer = gl_InstanceID;
}
