#include "output/eigen_text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "model/suffix_format.h"

namespace mbcosim {

namespace {

std::string formatted(const char* format, auto... values) {
  char buffer[256];
  const int n = std::snprintf(buffer, sizeof buffer, format, values...);
  return std::string(buffer, static_cast<std::size_t>(std::min<int>(n, sizeof buffer - 1)));
}

std::string scientific(double v, int precision) { return formatted("%.*e", precision, v); }

int matrix_digits(const EigenSettings& s) {
  return s.matrix_precision > 0 ? s.matrix_precision : 6;
}
int result_digits(const EigenSettings& s) {
  return s.results_precision > 0 ? s.results_precision : 6;
}

void append_full(std::string& out, const char* name, const Model& model,
                 const std::vector<double>& values, int digits) {
  const MatX m = model.dense(values);
  out += formatted("%% %s: %d x %d\n%s = [\n", name, model.unknowns, model.unknowns, name);
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) (out += ' ') += scientific(m(i, j), digits);
    out += '\n';
  }
  out += "];\n";
}

void append_sparse(std::string& out, const char* name, const Model& model,
                   const std::vector<double>& values, int digits) {
  out += formatted("%% %s: %d x %d\n%s = [\n", name, model.unknowns, model.unknowns, name);
  for (int j = 0; j < model.unknowns; ++j)
    for (int k = model.column_start[j]; k < model.column_start[j + 1]; ++k)
      if (values[k] != 0)
        out += formatted(" %d %d ", model.row_index[k] + 1, j + 1) + scientific(values[k], digits) +
               '\n';
  out +=
      formatted(" %d %d 0\n];\n%s = spconvert(%s);\n", model.unknowns, model.unknowns, name, name);
}

void append_vectors(std::string& out, const char* name, const Eigen::MatrixXcd& v,
                    const std::vector<int>& modes, int digits) {
  out += formatted("%% %s: one column per mode\n%s = [\n", name, name);
  for (Eigen::Index i = 0; i < v.rows(); ++i) {
    for (const int j : modes) {
      const double im = v(i, j).imag();
      out += ' ' + scientific(v(i, j).real(), digits) + (std::signbit(im) ? '-' : '+') +
             scientific(std::abs(im), digits) + 'i';
    }
    out += '\n';
  }
  out += "];\n";
}

void append_geometry(std::string& out, const EigenReport& report, int digits) {
  out += "% labels of the structural nodes\nlabels = [\n";
  for (const auto& n : report.nodes) out += formatted(" %d\n", n.label);
  out += "];\n% first unknown of each node, from zero\nidx = [\n";
  for (const auto& n : report.nodes) out += formatted(" %d\n", n.first_unknown);
  out += "];\n% position (m) and rotation vector (rad) of each node\nX0 = [\n";
  for (const auto& n : report.nodes) {
    for (int i = 0; i < 3; ++i) out += ' ' + scientific(n.x(i), digits) + '\n';
    for (int i = 0; i < 3; ++i) out += ' ' + scientific(n.rotation(i), digits) + '\n';
  }
  out += "];\n";
}

}  // namespace

std::string eigen_table(const EigenReport& report) {
  const GeneralizedEigen& s = report.solution;
  std::string out;
  if (report.settings.solver == EigenSettings::Solver::lapack)
    out = formatted("Info: 0, success BALANC=\"%c\" ILO=%d IHI=%d ABNRM=%g BBNRM=%g\n",
                    "NPSB"[static_cast<int>(report.settings.balance)], s.first + 1, s.last + 1,
                    s.norm_a, s.norm_b);
  else
    out = formatted("Info: 0, success %d eigenvalues nearest to %g 1/s\n", s.last + 1,
                    1 / report.pencil.kappa);
  out +=
      formatted("%8s  %12s  %12s   %12s  %12s\n", "Mode n.", "Real", "Imag", "Damp %", "Freq Hz");
  for (const int k : report.modes) {
    const std::complex<double> e = report.eigenvalue(k);
    const double size = std::abs(e);
    out += formatted("%7d:  %12g + %12g j  %12g  %12g\n", k + 1, e.real(), e.imag(),
                     size > 0 ? -100 * e.real() / size : 0.0, e.imag() / (2 * M_PI));
  }
  return out;
}

std::string eigen_suffix(const EigenReport& report) {
  return eigen_suffix(report.settings, report.index, report.count);
}

std::string eigen_suffix(const EigenSettings& settings, int index, int count) {
  const int width = settings.suffix_width >= 0 ? settings.suffix_width
                                               : static_cast<int>(std::to_string(count - 1).size());
  const SuffixFormat format = *SuffixFormat::parse(settings.suffix_format);
  return "_" + format.text(index, width);
}

std::string eigen_file(const EigenReport& report, const Model& model) {
  const EigenSettings& s = report.settings;
  const int matrix = matrix_digits(s), result = result_digits(s);
  std::string out = "% time (s)\ndTime = " + scientific(report.time, result) +
                    ";\n% coefficient (s)\ndCoef = " + scientific(report.pencil.kappa, result) +
                    ";\n";
  if (s.matrices_full) {
    append_full(out, "Aplus", model, report.pencil.plus, matrix);
    append_full(out, "Aminus", model, report.pencil.minus, matrix);
  } else if (s.matrices_sparse) {
    append_sparse(out, "Aplus", model, report.pencil.plus, matrix);
    append_sparse(out, "Aminus", model, report.pencil.minus, matrix);
  }
  if (s.geometry) append_geometry(out, report, result);
  if (!s.eigenvectors) return out;
  out += "% alpha: re(alpha), im(alpha), beta of each mode\nalpha = [\n";
  for (const int k : report.modes)
    out += ' ' + scientific(report.solution.alpha_r(k), result) + ' ' +
           scientific(report.solution.alpha_i(k), result) + ' ' +
           scientific(report.solution.beta(k), result) + '\n';
  out += "];\n";
  if (report.solution.left.cols() > 0)
    append_vectors(out, "VL", report.solution.left, report.modes, result);
  append_vectors(out, "VR", report.solution.right, report.modes, result);
  return out;
}

}  // namespace mbcosim
