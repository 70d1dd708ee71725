// What a user's own shader may use besides surface.glsl, fresnel.glsl, latlong.glsl and sh.glsl: docs/adding-a-technique.md.
uniform float alpha;            // GGX or Beckmann width of the material; of a Phong lobe, that of the same peak
uniform float time;             // [s], -p time=…
uniform sampler2D brdf_table;   // split sum: textureLod(brdf_table, vec2(n·v, sqrt(alpha)), 0.0).rg is (A, B), albedo F₀A + B
