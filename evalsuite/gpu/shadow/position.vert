in vec3 in_position;
uniform mat4 world_to_clip;
out vec3 v_position;

invariant gl_Position;

void main() {
    gl_Position = world_to_clip * vec4(in_position, 1.0);
    v_position = in_position;
}
