// Covered part → visible part. Occluders add up, as penumbra wedges have it; what is covered twice over stays covered.
layout(local_size_x = 8, local_size_y = 8) in;
uniform sampler2D covered;  // by what faces the light, by what faces away
layout(r32f, binding = 0) writeonly uniform image2DArray visibility;
uniform int light;

const float ROUNDING = 2e-6;  // of sums in float32: an umbra is black

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, textureSize(covered, 0)))) return;
    vec2 c = texelFetch(covered, pixel, 0).rg;
    float visible = 1.0 - clamp(max(c.r, c.g), 0.0, 1.0);
    imageStore(visibility, ivec3(pixel, light), vec4(visible < ROUNDING ? 0.0 : visible));
}
