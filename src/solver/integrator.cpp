#include "solver/integrator.h"

namespace mbcosim {

namespace {

/// β and δ of the two-step method with asymptotic spectral radius ρ.
struct Multistep {
  double beta, b0, b1, b2;
  Multistep(double h, double h_previous, double rho) {
    const double a = h / h_previous, q = (1 - rho) * (1 - rho);
    const double d = 2 * (1 + a) - q;
    beta = a * (q * (2 + a) + 2 * (2 * rho - 1) * (1 + a)) / d;
    const double delta = 0.5 * a * a * q / d;
    b0 = h_previous * (delta / a + a / 2);
    b1 = h_previous * (beta / 2 + a / 2 - delta / a * (1 + a));
    b2 = h_previous * (beta / 2 + delta);
  }
};

void use_cubic_predictor(StepFormula& f, double h, double h_previous) {
  const double a = h / h_previous;
  f.two_step = true;
  f.m0 = -6 * a * (1 + a) / h_previous;
  f.m1 = -f.m0;
  f.n0 = 1 + 4 * a + 3 * a * a;
  f.n1 = a * (2 + 3 * a);
}

StepFormula crank_nicolson(double h) {
  StepFormula f;
  f.b0 = f.b1 = f.i0 = f.i1 = h / 2;
  return f;
}

StepFormula multistep(double h, double h_previous, double rho, double rho_algebraic) {
  const Multistep d(h, h_previous, rho), a(h, h_previous, rho_algebraic);
  StepFormula f;
  f.a1 = 1 - d.beta;
  f.a2 = d.beta;
  f.b0 = d.b0;
  f.b1 = d.b1;
  f.b2 = d.b2;
  f.i0 = a.b0;
  f.i1 = a.b1;
  f.i2 = a.b2;
  f.j1 = -a.beta;
  use_cubic_predictor(f, h, h_previous);
  return f;
}

/// The even formula y = (1 − b) y₁ + b y₂ + c ẏ + b1 ẏ₁ with b = (A − 1)/3, A = 4ρ/(3 + ρ). With
/// t = 0 at y₁, h at y and −h′ at y₂ it holds for y = t and y = t² when
///
///   h  = −b h′ + c + b1,    h²/2 = b h′²/2 + c h
///
///   c  = (h/2) (1 − b/α²)           = (h/6) (4 − A + (A − 1)(1 − 1/α²))
///   b1 = (h/2) (1 + b (2/α + 1/α²)) = (h/2) (A + (A − 1)(1 − α)(1 + 3α)/(3α²))
///
/// written so that equal steps (α = 1) give the published coefficients to the last bit.
struct EvenHope {
  double a1, a2, c, b1;
  EvenHope(double h, double h_previous, double rho) {
    const double A = 4 * rho / (3 + rho), a = h / h_previous, q = a * a;
    a1 = (4 - A) / 3;
    a2 = (A - 1) / 3;
    c = h * (4 - A + (A - 1) * (1 - 1 / q)) / 6;
    b1 = h * (A + (A - 1) * (1 - a) * (1 + 3 * a) / (3 * q)) / 2;
  }
};

StepFormula hope(double h, double h_previous, double rho, double rho_algebraic, bool odd) {
  StepFormula f = crank_nicolson(h);
  if (!odd) {
    const EvenHope d(h, h_previous, rho), a(h, h_previous, rho_algebraic);
    f.a1 = d.a1;
    f.a2 = d.a2;
    f.b0 = d.c;
    f.b1 = d.b1;
    f.i0 = a.c;
    f.i1 = a.b1;
    f.j1 = -a.a2;
  }
  use_cubic_predictor(f, h, h_previous);
  return f;
}

}  // namespace

StepFormula step_formula(Method method, double h, double h_previous, double rho,
                         double rho_algebraic, bool odd) {
  switch (method) {
    case Method::bdf1:
    case Method::third_order:
    case Method::third_order_ad_hoc: {  // the third-order method's own prediction of the end of the
                                        // step
      StepFormula f;
      f.b0 = f.i0 = h;
      return f;
    }
    case Method::multistep:
      return multistep(h, h_previous, rho, rho_algebraic);
    case Method::hope:
      return hope(h, h_previous, rho, rho_algebraic, odd);
    case Method::crank_nicolson:
      break;
  }
  return crank_nicolson(h);
}

}  // namespace mbcosim
