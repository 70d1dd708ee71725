// Whether a surface counts, where a technique has drawn it and where it has left a hole.
uniform float scored;
layout(location = 0) out vec4 out_alpha;

void main() {
    out_alpha = vec4(0.0, 0.0, 0.0, scored);
}
