// The room's triangles, once for each of six faces and k × k samples a texel, each instance into a tile of its own: tiles lie
// side by side, sample i + kj of a face in column i and row j of the face's k rows. A face's x runs along s, its y along t.
in vec3 in_position;
uniform vec3 centre;
uniform vec2 depth_range;  // near, far
uniform int subsamples;    // k
uniform float face_size;   // texels
flat out int v_triangle;
out vec2 v_weights;        // of the triangle's second and third corner
out vec3 v_position;
out gl_PerVertex { vec4 gl_Position; float gl_ClipDistance[4]; };

void main() {
    int corner = gl_VertexID % 3, face = gl_InstanceID / (subsamples * subsamples);
    ivec2 cell = ivec2(gl_InstanceID % subsamples, gl_InstanceID / subsamples % subsamples);
    v_triangle = gl_VertexID / 3;
    v_weights = vec2(corner == 1, corner == 2);
    v_position = in_position;
    vec3 p = in_position - centre;
    float w = dot(AXIS[face], p);
    // The sample falls on the pixel's centre.
    vec2 shift = 1.0 - 2.0 * subsample_offset(gl_InstanceID % (subsamples * subsamples), subsamples);
    vec2 xy = vec2(dot(S[face], p), dot(T[face], p)) + shift / face_size * w;
    gl_ClipDistance[0] = w + xy.x;
    gl_ClipDistance[1] = w - xy.x;
    gl_ClipDistance[2] = w + xy.y;
    gl_ClipDistance[3] = w - xy.y;
    vec2 tiles = vec2(subsamples, 6 * subsamples), tile = vec2(cell) + vec2(0, face * subsamples);
    float near = depth_range.x, far = depth_range.y;
    gl_Position = vec4((xy + (2.0 * tile + 1.0 - tiles) * w) / tiles, ((far + near) * w - 2.0 * far * near) / (far - near), w);
}
