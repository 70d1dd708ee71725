// One level of a cubemap into a buffer: moderngl reads level 0 alone.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;
layout(rgba32f, binding = 0) readonly uniform imageCube level;
layout(std430, binding = 0) writeonly buffer Out { vec4 texels[]; };

void main() {
    ivec3 texel = ivec3(gl_GlobalInvocationID);
    int width = imageSize(level).x;
    if (texel.x < width && texel.y < width) texels[(texel.z * width + texel.y) * width + texel.x] = imageLoad(level, texel);
}
