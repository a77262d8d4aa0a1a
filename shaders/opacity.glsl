// In: an optical depth x. Out: 1 - exp(-x), without cancellation at small x. Mirrors the opacity in
// render/splat.h.
float opacity(float x)
{
    return x < 1e-3 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
}
