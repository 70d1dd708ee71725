// L_i of the environment, math.sh.project_cube.
uniform vec3 sh[9];

// math.sh.irradiance: E(n) = Σ Â_i L_i Y_i(n).
vec3 irradiance(vec3 n) {
    const float zero = 0.28209479177387814;   // √(1/4π)
    const float one = 0.4886025119029199;     // √(3/4π)
    const float two = 1.0925484305920792;     // √(15/4π)
    const float twenty = 0.31539156525252005; // √(5/16π)
    vec3 sum = PI * zero * sh[0];
    sum += (2.0 * PI / 3.0) * one * (n.y * sh[1] + n.z * sh[2] + n.x * sh[3]);
    sum += (PI / 4.0) * two * (n.x * n.y * sh[4] + n.y * n.z * sh[5] + n.x * n.z * sh[7]);
    sum += (PI / 4.0) * (twenty * (3.0 * n.z * n.z - 1.0) * sh[6] + 0.5 * two * (n.x * n.x - n.y * n.y) * sh[8]);
    return sum;
}
