in vec3 v_position;
layout(location = 0) out vec4 out_position;

void main() {
    out_position = vec4(v_position, 1.0);
}
