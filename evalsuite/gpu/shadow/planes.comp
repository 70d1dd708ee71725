// The plane of each triangle, (n, −n·a): once a triangle, so that all its edges agree on which way it faces.
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Positions { vec4 position[]; };
layout(std430, binding = 1) readonly buffer Faces { ivec4 face[]; };
layout(std430, binding = 2) writeonly buffer Planes { vec4 plane[]; };
uniform int faces;

void main() {
    int index = int(gl_GlobalInvocationID.x);
    if (index >= faces) return;
    ivec3 corner = face[index].xyz;
    vec3 a = position[corner.x].xyz;
    vec3 n = normalize(cross(position[corner.y].xyz - a, position[corner.z].xyz - a));
    plane[index] = vec4(n, -dot(n, a));
}
