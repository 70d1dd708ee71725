// An edge with the planes of the triangles on both sides, as silhouettes.comp writes it.
in vec4 in_from;  // w: 1 where there is a triangle on the right
in vec4 in_to;
in vec4 in_left;  // planes
in vec4 in_right;
