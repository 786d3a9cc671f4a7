/// Composite cantilevers with a weight at the tip against measurements.
///
/// Experiment: P. Minguet and J. Dugundji, "Experiments and analysis for composite blades under
/// large deflections, part 1: static behavior", AIAA Journal 28(9), 1990, doi 10.2514/3.25255.
/// Clamped laminated strips of 30 mm width and 1.5 to 1.9 mm thickness, root pitched by 0 or 45
/// degrees, a weight of up to 500 g hung at 0.550 m; displacements of the point at 0.500 m, counted
/// from the unloaded state.
///
/// Stiffness of the sections: table 2 of the paper, as AeroBeams.jl (L. Pancini, MIT licence) has
/// it. Measured points: two digitised readings of the paper's figures, one distributed with
/// AeroBeams.jl (both pitch angles), one with SHARPy (Imperial College London, BSD-3 licence; pitch
/// 0 only, its beams c090 and c2070 are 1 and 3 here). Computed values of another geometrically
/// exact code: AeroBeams.jl. The order of strains and the signs are those of AeroBeams.jl; SHARPy's
/// second shear stiffness of beam 3 is a tenth of the one here, which changes some
/// hundredths of a millimetre, and its script puts load and point at other places (510 and 550 mm),
/// which the curves that the paper computed itself do not fit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>
#include <vector>

#include "simulation/beam_line.h"
#include "simulation/exact_cantilever.h"

namespace mbcosim::measured_beams_test {
namespace {

constexpr double kLength = .55, kStation = .5, kGravity = 9.80665;

/// Section of a beam of the paper; strains: axial, shear 2, shear 3, twist, flap and chord bending.
struct Laminate {
  Vec6 stiffness;
  Mat6 coupling = Mat6::Zero();
};

/// Beam 1 has no coupling, 2 couples extension with shear and twist with bending, 3 extension with
/// twist.
Laminate laminate(int beam) {
  if (beam == 1) return {vec6(3.7e6, 2.6e5, 2.9e5, .183, .707, 276)};
  Laminate l{beam == 2 ? vec6(4e6, 2.6e5, 5.5e5, .368, .522, 298)
                       : vec6(3.9e6, 1.1e6, 1.2e5, 1.18, .983, 290)};
  const auto couple = [&l](int i, int j, double value) {
    l.coupling(i, j) = l.coupling(j, i) = value;
  };
  if (beam == 2) {
    couple(0, 1, -2.7e5);
    couple(3, 4, -.102);
  } else {
    couple(0, 3, -522);
  }
  return l;
}

Mat3 pitched(double degrees) { return rotation_of_vector<double>(Vec3(degrees * kPi / 180, 0, 0)); }

/// Displacements u₁ (along the beam), u₂ (sideways), u₃ (up) of the station under 0, 5, …, 500 g.
class Curve {
 public:
  Curve(int beam, double degrees, int elements_to_station = 10) {
    Line line;
    const int pieces = 2 * elements_to_station, more = std::max(2, pieces / 10 * 2);
    for (int k = 0; k <= pieces; ++k) line.position.push_back(Vec3(kStation * k / pieces, 0, 0));
    for (int k = 1; k <= more; ++k)
      line.position.push_back(Vec3(kStation + (kLength - kStation) * k / more, 0, 0));
    line.stiffness = laminate(beam).stiffness;
    line.coupling = laminate(beam).coupling;
    line.orientation = matrix_words<3>(pitched(degrees));
    line.step = kStep;
    line.initial = kQuasiStatic;
    line.loads = " force: 1, absolute, " + std::to_string(line.tip()) +
                 ", position, null, 0.,0.,-1., ramp, " + digits(1e-3 * kGravity) +
                 ", 0., 500., 0.;\n";
    DeckRun run(line.deck());
    if (!run.ready()) return;
    u_.push_back(Vec3::Zero());
    for (double load = kStep; load < 501; load += kStep) {
      run.step();
      u_.push_back(run.node(pieces).x - Vec3(kStation, 0, 0));
    }
  }
  bool ready() const { return u_.size() == 101; }
  /// At a load in grams.
  Vec3 at(double grams) const {
    const auto k = std::min<std::size_t>(static_cast<std::size_t>(grams / kStep), u_.size() - 2);
    const double part = grams / kStep - static_cast<double>(k);
    return (1 - part) * u_[k] + part * u_[k + 1];
  }

 private:
  static constexpr double kStep = 5;  ///< [g]; with twice as much Newton's method may fail, beam 2
  std::vector<Vec3> u_;
};

/// What a table is about.
struct Case {
  int beam;
  double pitch;  ///< [degrees]
  int component;

  std::string name() const {
    return "beam " + std::to_string(beam) + ", pitch " + digits(pitch) + ", u" +
           std::to_string(component + 1);
  }
};
std::vector<double> numbers(std::string text) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream in(text);
  return {std::istream_iterator<double>(in), {}};
}

TEST(CompositeCantilever, ComesToTheExactBeamWithFourthOrder) {
  for (const int beam : {1, 2, 3})
    for (const double pitch : {0., 45.}) {
      SCOPED_TRACE("beam " + std::to_string(beam) + ", pitch " + digits(pitch));
      const Curve coarse(beam, pitch, 5), fine(beam, pitch, 10);
      ASSERT_TRUE(coarse.ready() && fine.ready());
      const Laminate l = laminate(beam);
      const ExactCantilever exact{kLength, Mat6(l.stiffness.asDiagonal()) + l.coupling};
      const Mat3 root = pitched(pitch);
      double error[2] = {};
      for (const double grams : {100., 300., 500.}) {
        const Vec3 force(0, 0, -1e-3 * grams * kGravity);
        const Vec3 r = root * exact.solve(root.transpose() * force, 20, kStation).r;
        const Vec3 u = r - Vec3(kStation, 0, 0);
        error[0] = std::max(error[0], (coarse.at(grams) - u).norm());
        error[1] = std::max(error[1], (fine.at(grams) - u).norm());
      }
      EXPECT_LT(error[1], 5e-6);  // displacements are up to .3 m
      EXPECT_NEAR(std::log2(error[0] / error[1]), 4, .1);
    }
}

/// Results of AeroBeams.jl (22 elements) under 50, 100, …, 500 g [m].
struct Computed {
  Case at;
  const char* u;
};
constexpr Computed kAeroBeams[] = {
    {{1, 0, 0},
     "-.0013275 -.0051843 -.0112298 -.0189974 -.0279925 -.0377643 -.0479426 -.0582451 -.0684691 "
     "-.0784766"},
    {{1, 0, 2},
     "-.0330538 -.0651756 -.0955892 -.1237689 -.1494520 -.1725933 -.1932960 -.2117478 -.2281738 "
     "-.2428048"},
    {{1, 45, 0},
     "-.0006720 -.0027187 -.0062147 -.0112261 -.0177354 -.0255853 -.0344845 -.0440773 -.0540237 "
     "-.0640491"},
    {{1, 45, 1},
     ".0165231 .0327805 .0484267 .0630028 .0759929 .0869686 .0957328 .1023565 .1071015 .1103088"},
    {{1, 45, 2},
     "-.0167389 -.0339891 -.0521603 -.0714412 -.0916968 -.1124647 -.1330997 -.1529850 -.1716782 "
     "-.1889448"},
    {{2, 0, 0},
     "-.0026956 -.0102485 -.0213672 -.0346092 -.0487952 -.0631207 -.0771005 -.0904718 -.1031125 "
     "-.1149839"},
    {{2, 0, 1},
     ".0007402 .0027542 .0055589 .0086534 .0116768 .0144292 .0168298 .0188679 .0205678 .0219683"},
    {{2, 0, 2},
     "-.0470585 -.0913296 -.1309692 -.1653212 -.1945803 -.2193462 -.2403219 -.2581673 -.2734476 "
     "-.2866270"},
    {{2, 45, 0},
     "-.0013062 -.0049618 -.0105956 -.0178743 -.0264911 -.0361486 -.0465530 -.0574207 -.0684924 "
     "-.0795481"},
    {{2, 45, 1},
     ".0233383 .0454926 .0660465 .0847259 .1013495 .1158140 .1280973 .1382628 .1464520 .1528643"},
    {{2, 45, 2},
     "-.0230343 -.0446789 -.0652266 -.0849206 -.1039077 -.1222311 -.1398503 -.1566767 -.1726113 "
     "-.1875739"},
    {{3, 0, 0},
     "-.0006895 -.0027234 -.0060038 -.0103836 -.0156865 -.0217262 -.0283223 -.0353111 -.0425511 "
     "-.0499249"},
    {{3, 0, 2},
     "-.0238303 -.0473062 -.0701055 -.0919633 -.1126857 -.1321510 -.1503027 -.1671372 -.1826897 "
     "-.1970217"},
    {{3, 45, 0},
     "-.0003459 -.0013789 -.0030848 -.0054399 -.0084123 -.0119617 -.0160411 -.0205976 -.0255743 "
     "-.0309118"},
    {{3, 45, 1},
     ".0118895 .0236889 .0353096 .0466674 .0576834 .0682864 .0784143 .0880153 .0970493 .1054878"},
    {{3, 45, 2},
     "-.0119817 -.0239386 -.0358452 -.0476751 -.0594004 -.0709923 -.0824206 -.0936551 -.1046659 "
     "-.1154244"},
};

TEST(CompositeCantilever, AsAeroBeamsComputesIt) {
  for (const Computed& c : kAeroBeams) {
    SCOPED_TRACE(c.at.name());
    const Curve curve(c.at.beam, c.at.pitch);
    const std::vector<double> published = numbers(c.u);
    ASSERT_TRUE(curve.ready() && published.size() == 10);
    for (int k = 0; k < 10; ++k) {
      const Vec3 u = curve.at(50 * (k + 1));
      EXPECT_NEAR(u(c.at.component), published[k], 1e-3 * u.norm()) << 50 * (k + 1) << " g";
    }
  }
}

/// Readings of a figure of the paper: pairs of load [g] and displacement [mm], which is positive
/// against u₁, with u₂ and against u₃.
struct Reading {
  Case at;
  const char* points;
};

/// Ours less what is read, both in millimetres, is within constant + share × reading. A reading
/// that is no larger than its bound would be met by a beam that does not move: it has no place
/// here.
void expect_as_read(const Reading& reading, double constant, double share) {
  SCOPED_TRACE(reading.at.name());
  const Curve curve(reading.at.beam, reading.at.pitch);
  const std::vector<double> points = numbers(reading.points);
  ASSERT_TRUE(curve.ready() && !points.empty() && points.size() % 2 == 0);
  for (std::size_t k = 0; k < points.size(); k += 2) {
    const int i = reading.at.component;
    const double u = (i == 1 ? 1e3 : -1e3) * curve.at(points[k])(i);
    const double bound = constant + share * points[k + 1];
    EXPECT_GT(points[k + 1], bound) << "no displacement at all would pass at " << points[k] << " g";
    EXPECT_NEAR(u, points[k + 1], bound) << points[k] << " g";
  }
}

/// The curves that Minguet and Dugundji computed themselves (pitch 0, beams 1 and 3), as read by
/// SHARPy's authors, up to 500 g. What is read strays by some millimetres: at the smallest loads,
/// where every theory is linear and gives the same, by 2 mm for beam 3. Readings below the bound of
/// 4 mm are left out.
TEST(CompositeCantilever, AsThePaperComputesIt) {
  const Reading curves[] = {
      {{1, 0, 0},
       "130.75 8.90, 161.23 12.90, 192.70 17.92, 234.99 24.94, "
       "269.41 31.98, 309.74 40.02, 351.05 48.06, 392.36 57.78"},
      {{1, 0, 2},
       "10.84 6.74, 31.53 21.23, 46.32 31.68, 68.97 45.49, 95.57 61.33, 126.12 81.54, 150.75 "
       "96.70, 181.28 114.22, 203.94 126.34, 233.48 142.51, 274.84 162.04, 318.15 180.21, 353.60 "
       "196.02, 381.15 205.78, 400.83 211.82"},
      {{3, 0, 0},
       "151.13 5.31, 196.46 9.44, 242.94 14.91, 287.09 21.06, "
       "337.05 27.89, 381.20 34.03, 434.64 41.88, 481.11 48.70"},
      {{3, 0, 2},
       "18.56 6.77, 41.76 17.61, 66.11 29.45, 88.13 40.96, 105.52 50.43, 128.72 59.91, 157.71 "
       "73.79, 191.34 88.68, 212.22 97.83, 231.94 106.97, 255.14 116.45, 282.98 127.63, 313.15 "
       "138.47, 343.31 149.65, 374.65 160.49, 410.62 173.37, 437.31 182.19, 475.62 192.37"}};
  for (const Reading& curve : curves) expect_as_read(curve, 4, 0);
}

/// The measured points. No uncertainty of measurement is known to us; the bounds here are what
/// theory and measurement differ by in the literature: in the paper's own computation and in that
/// of AeroBeams.jl. Beam 3, say, is measured to bend 6 to 17 % more than either computes, from
/// 50 g on.
///
/// Left out: beam 2, for which the paper's own computation and AeroBeams.jl differ from each other
/// by 14 mm at 400 g, so that the published stiffness is in doubt; u₁ of beam 3, measured a third
/// or more above either computation; u₂ at pitch 0, where it should be nothing and up to 3.2 mm are
/// read; readings of u₁ below its bound of 6 mm, at loads where it is a second-order effect: .64 to
/// 5.83 mm up to 150 g, 2 mm more than any theory at 20 g. All other points of both readings are
/// here, also those that stand out (beam 1: u₁ at pitch 0 and 150 g, u₃ at pitch 45 and 50 g).
TEST(CompositeCantilever, AsMeasured) {
  const Reading along[] = {{{1, 0, 0}, "150 6.34, 200 21.14, 400 61.21"},
                           {{1, 45, 0}, "200 12.98, 400 45.74"},
                           {{1, 0, 0}, "199.59 20.95, 400.24 60.81"}};
  const Reading across[] = {
      {{1, 0, 2}, "20 14.12, 50 35.86, 75 53.24, 100 69.11, 150 101.43, 200 130.90, 400 217.90"},
      {{1, 45, 1}, "50 18.22, 200 67.81, 400 114.16"},
      {{1, 45, 2}, "20 6.74, 50 13.41, 75 26.33, 200 73.17, 400 149.42"},
      {{3, 0, 2}, "20 11.28, 50 27.24, 100 52.91, 200 102.04, 300 145.09, 400 179.67, 500 208.79"},
      {{3, 45, 1}, "20 6.41, 50 13.89, 100 25.75, 200 52.97, 300 76.10, 400 97.23, 500 115.28"},
      {{3, 45, 2}, "20 6.39, 50 13.70, 100 26.95, 200 53.84, 300 80.05, 400 106.25, 500 128.76"},
      {{1, 0, 2},
       "19.71 13.48, 49.28 35.39, 75.88 52.91, 101.50 68.75, 150.77 101.10, 200.02 130.41, 400.86 "
       "217.57"},
      {{3, 0, 2},
       "20.86 11.16, 53.33 27.41, 99.69 52.78, 201.73 102.53, 299.15 145.53, 397.79 180.10, 501.11 "
       "209.27"}};
  for (const Reading& points : along) expect_as_read(points, 6, 0);
  for (const Reading& points : across) expect_as_read(points, 3, .1);
}

}  // namespace
}  // namespace mbcosim::measured_beams_test
