// A cubemap filtered with one lobe round about each texel's direction, by its sample set: math.prefilter.filter_cube.
struct Sample {
    vec4 direction_level;  // about +z; MIP level of the source
    vec4 weight;
};
layout(std430, binding = 0) readonly buffer Samples { Sample samples[]; };
uniform samplerCube source;
uniform int count;

void main() {
    ivec3 texel = filter_texel();
    int width = imageSize(target).x;
    if (texel.x >= width || texel.y >= width) return;
    vec3 z = filter_axis(texel, width);
    // math.prefilter.frame
    float side = z.z < 0.0 ? -1.0 : 1.0;
    float a = -1.0 / (side + z.z), b = z.x * z.y * a;
    mat3 world = mat3(vec3(1.0 + side * z.x * z.x * a, side * b, -side * z.x), vec3(b, side + z.y * z.y * a, -z.y), z);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < count; ++i) {
        Sample one = samples[i];
        sum += one.weight.x * textureLod(source, world * one.direction_level.xyz, one.direction_level.w).rgb;
    }
    imageStore(target, texel, vec4(sum, 1.0));
}
