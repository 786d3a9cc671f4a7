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

StepFormula hope(double h, double h_previous, double rho, double rho_algebraic, bool odd) {
  StepFormula f = crank_nicolson(h);
  if (!odd) {
    const double d = 4 * rho / (3 + rho), a = 4 * rho_algebraic / (3 + rho_algebraic);
    f.a1 = (4 - d) / 3;
    f.a2 = (d - 1) / 3;
    f.b0 = h * (4 - d) / 6;
    f.b1 = h * d / 2;
    f.i0 = h * (4 - a) / 6;
    f.i1 = h * a / 2;
    f.j1 = -(a - 1) / 3;
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
