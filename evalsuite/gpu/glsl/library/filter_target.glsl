// Where a prefilter's compute shader writes: one level of a cubemap (cube_faces.glsl comes before), or with OCTAHEDRAL one layer
// of a volume of octahedral maps (octahedral.glsl before). filter_axis is the direction that a texel stands for.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
uniform int first_row;

#ifdef OCTAHEDRAL
layout(rgba32f, binding = 0) writeonly uniform image3D target;
uniform int layer;

vec3 filter_axis(ivec3 texel, int width) {
    return octahedral_to_direction((2.0 * vec2(texel.xy) - 1.0) / float(width - 2) - 1.0);
}
#else
layout(rgba32f, binding = 0) writeonly uniform imageCube target;
const int layer = 0;

vec3 filter_axis(ivec3 texel, int width) {
    return normalize(face_direction(texel.z, (2.0 * vec2(texel.xy) + 1.0) / float(width) - 1.0));
}
#endif

ivec3 filter_texel() { return ivec3(gl_GlobalInvocationID) + ivec3(0, first_row, layer); }
