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

void append_full(std::string& out, const char* name, char sign, const Model& model,
                 const std::vector<double>& values, int digits) {
  const MatX m = model.dense(values);
  out += formatted("%% F/xPrime %c dCoef * F/x\n%s = [", sign, name);
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) (out += scientific(m(i, j), digits)) += ' ';
    out += i + 1 < m.rows() ? ";\n" : "];\n";
  }
}

void append_sparse(std::string& out, const char* name, char sign, const Model& model,
                   const std::vector<double>& values, int digits) {
  out += formatted("%% F/xPrime %c dCoef *F/x\n%s = [", sign, name);
  for (int j = 0; j < model.unknowns; ++j)
    for (int k = model.column_start[j]; k < model.column_start[j + 1]; ++k)
      if (values[k] != 0)
        out += formatted("%d %d ", model.row_index[k] + 1, j + 1) + scientific(values[k], digits) +
               ";\n";
  out += formatted("];\n%s = spconvert(%s);\n", name, name);
}

void append_matrices(std::string& out, const EigenReport& report, const Model& model, int digits) {
  const auto append = report.settings.matrices_full ? append_full : append_sparse;
  append(out, "Aplus", '+', model, report.pencil.plus, digits);
  append(out, "Aminus", '-', model, report.pencil.minus, digits);
}

/// Columns are modes; real ones have real numbers.
void append_vectors(std::string& out, const char* title, const char* name,
                    const Eigen::MatrixXcd& v, const EigenReport& report, int digits) {
  out += formatted("%% %s eigenvectors\n%s = [\n", title, name);
  for (Eigen::Index i = 0; i < v.rows(); ++i) {
    for (const int j : report.modes) {
      const double im = v(i, j).imag();
      out += scientific(v(i, j).real(), digits);
      if (report.solution.alpha_i(j) != 0)
        out += (std::signbit(im) ? "-i*" : "+i*") + scientific(std::abs(im), digits);
      out += ' ';
    }
    out += i + 1 < v.rows() ? ";\n" : "];\n";
  }
}

void append_geometry(std::string& out, const EigenReport& report, int digits) {
  out += "% structural nodes labels\nlabels = [\n";
  for (const auto& n : report.nodes) out += formatted("%d;\n", n.label);
  out += "];\n% structural nodes base index\nidx = [\n";
  for (const auto& n : report.nodes) out += formatted("%d;\n", n.first_unknown);
  out += "];\n% structural nodes reference configuration (X, Phi)\nX0 = [\n";
  for (const auto& n : report.nodes) {
    for (int i = 0; i < 3; ++i) out += scientific(n.x(i), digits) + ";\n";
    for (int i = 0; i < 3; ++i) out += scientific(n.rotation(i), digits) + ";\n";
  }
  out += "];\n";
}

void append_modes(std::string& out, const EigenReport& report, int digits) {
  const GeneralizedEigen& s = report.solution;
  out += "% alphar, alphai, beta\nalpha = [";
  for (const int k : report.modes)
    out += scientific(s.alpha_r(k), digits) + ' ' + scientific(s.alpha_i(k), digits) + ' ' +
           scientific(s.beta(k), digits) + ";\n";
  out += "];\n";
  if (s.left.cols() > 0) append_vectors(out, "left", "VL", s.left, report, digits);
  append_vectors(out, "right", "VR", s.right, report, digits);
}

}  // namespace

std::string eigen_table(const EigenReport& report, int digits) {
  if (!report.settings.finds_modes()) return {};
  const GeneralizedEigen& s = report.solution;
  std::string out;
  if (report.settings.is_dense())
    out = formatted("Info: 0, success BALANC=\"%c\" ILO=%d IHI=%d ABNRM=%.*g BBNRM=%.*g\n",
                    "NPB"[static_cast<int>(report.settings.balance)], s.first + 1, s.last + 1,
                    digits, s.norm_a, digits, s.norm_b);
  else
    out = formatted("Info: 0, success %d eigenvalues nearest to %g 1/s\n", s.last + 1,
                    1 / report.pencil.kappa);
  out += "Mode n.       Real           Imag             Damp %     Freq Hz\n";
  for (const int k : report.modes) {
    const std::complex<double> e = report.eigenvalue(k);
    const double size = std::abs(e);
    out += formatted("%8d: %12.*g + %12.*g j    %12.*g    %12.*g\n", k + 1, digits, e.real(),
                     digits, e.imag(), digits, size > 0 ? -100 * e.real() / size : 0.0, digits,
                     e.imag() / (2 * M_PI));
  }
  return out;
}

std::string eigen_suffix(const EigenSettings& settings, int index) {
  const int width = settings.suffix_width >= 0
                        ? settings.suffix_width
                        : static_cast<int>(std::to_string(settings.times.size() - 1).size());
  const SuffixFormat format = *SuffixFormat::parse(settings.suffix_format);
  return "_" + format.text(index, width);
}

std::string eigen_file(const EigenReport& report, const Model& model) {
  const EigenSettings& s = report.settings;
  const auto digits = [&](int wanted) {
    return wanted > 0 ? wanted : model.control.output_precision;
  };
  const int result = digits(s.results_precision);
  const std::string time = scientific(report.time, result);
  std::string out = "% time: " + time + "\ndTime = " + time +
                    ";\n% coefficient\ndCoef = " + scientific(report.pencil.kappa, result) + ";\n";
  if (s.matrices_full || s.matrices_sparse)
    append_matrices(out, report, model, digits(s.matrix_precision));
  if (s.geometry) append_geometry(out, report, result);
  if (s.eigenvectors && !report.modes.empty()) append_modes(out, report, result);
  return out;
}

}  // namespace mbcosim
