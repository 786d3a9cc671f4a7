// Results of beams: the line of .act, the line of .log and private data.
#include <sstream>

#include "elements/beams/beam.h"

namespace mbcosim {

namespace {

/// Groups of private data at an evaluation point, three components each.
enum Group {
  kStrain,
  kCurvature,
  kForce,
  kMoment,
  kPosition,
  kOrientation,
  kAngularVelocity,
  kStrainRate,
  kCurvatureRate,
  kGroups
};
constexpr DatumName kGroupNames[kGroups] = {{"e", ""},          {"k", "1/m"},  {"F", "N"},
                                            {"M", "N m"},       {"X", "m"},    {"Phi", "rad"},
                                            {"Omega", "rad/s"}, {"eP", "1/s"}, {"kP", "1/(m s)"}};
constexpr const char* kPointPrefix[2] = {"pI.", "pII."};

template <int Nodes>
std::string prefix(int a) {
  return Nodes == 2 ? "" : kPointPrefix[a];
}

std::string orientation_name(OrientationDescription description) {
  return description == OrientationDescription::vector   ? "Phi"
         : description == OrientationDescription::matrix ? "R"
                                                         : "E";
}

}  // namespace

template <int Nodes>
void Beam<Nodes>::output(const Local<double>& u, OutputRow& row) const {
  using Field = BeamOutput::Field;
  const unsigned chosen = row.has_named_fields() ? fields.chosen : Field::force | Field::moment;
  const OrientationDescription description =
      fields.description.value_or(u.model().control.orientation);
  row.begin(OutputFile::act, u.label());
  const auto s = section(u, line(u), 0);
  using Loads = Eigen::Matrix<Wide<double>, 6, 1>;
  const Loads loads = is_unloaded(u) ? Loads(Loads::Constant(0.0)) : internal_force(u, 0, s);
  for (int a = 0; a < points; ++a) {
    const std::string suffix = Nodes == 2 ? "" : a == 0 ? "_I" : "_II";
    const Vec6 strain = lane(s.strain, a), rate = lane(s.rate, a), f = lane(loads, a);
    const auto vector = [&](Field field, const char* name, const char* unit, const Vec3& value) {
      if (chosen & field) row.vec3((name + suffix).c_str(), unit, value);
    };
    vector(Field::position, "X", "m", lane(s.p, a));
    if (chosen & Field::orientation)
      row.orientation((orientation_name(description) + suffix).c_str(), lane(s.R, a), description);
    vector(Field::force, "F", "N", f.template head<3>());
    vector(Field::moment, "M", "N m", f.template tail<3>());
    vector(Field::strain, "nu", "-", strain.template head<3>());
    vector(Field::curvature, "k", "1/m", strain.template tail<3>());
    vector(Field::strain_rate, "nuP", "1/s", rate.template head<3>());
    vector(Field::curvature_rate, "kP", "1/(m s)", rate.template tail<3>());
  }
  row.end();
}

template <int Nodes>
std::string Beam<Nodes>::log(const Model& model, int label) const {
  std::ostringstream out;
  out << "beam" << Nodes << ": " << label;
  for (int k = 0; k < Nodes; ++k)
    out << ' ' << model.structural[node[k]].label << ' ' << offset[k](0) << ' ' << offset[k](1)
        << ' ' << offset[k](2);
  return out.str();
}

template <int Nodes>
std::vector<Datum> Beam<Nodes>::private_data() const {
  std::vector<Datum> data;
  for (int a = 0; a < points; ++a)
    for (const DatumName& group : kGroupNames)
      for (const char axis : {'x', 'y', 'z'})
        data.push_back({prefix<Nodes>(a) + std::string(group.name) + axis, group.unit});
  return data;
}

template <int Nodes>
int Beam<Nodes>::private_datum(std::string_view name) const {
  for (int a = 0; a < points; ++a) {
    const std::string start = prefix<Nodes>(a);
    if (!name.starts_with(start)) continue;
    const std::string_view rest = name.substr(start.size());
    for (int group = 0; group < kGroups; ++group) {
      const std::string_view word = kGroupNames[group].name;
      if (rest.size() != word.size() + 1 || !rest.starts_with(word)) continue;
      const int axis = rest.back() - 'x';
      if (axis >= 0 && axis < 3) return (a * kGroups + group) * 3 + axis;
    }
  }
  return -1;
}

template <int Nodes>
double Beam<Nodes>::private_value(const Local<double>& u, int datum) const {
  const int axis = datum % 3, group = datum / 3 % kGroups, a = datum / 3 / kGroups;
  const auto s = section(u, line(u), 0);
  switch (group) {
    case kStrain:
      return lane(s.strain(axis), a);
    case kCurvature:
      return lane(s.strain(3 + axis), a);
    case kForce:
    case kMoment:
      return is_unloaded(u) ? 0
                            : lane(internal_force(u, 0, s)(group == kForce ? axis : 3 + axis), a);
    case kPosition:
      return lane(s.p(axis), a);
    case kOrientation:
      return vector_of_rotation(Mat3(lane(s.R, a)))(axis);
    case kAngularVelocity:
      return lane(s.w(axis), a);
    case kStrainRate:
      return lane(s.rate(axis), a);
    default:
      return lane(s.rate(3 + axis), a);
  }
}

template void Beam<2>::output(const Local<double>&, OutputRow&) const;
template std::string Beam<2>::log(const Model&, int) const;
template std::vector<Datum> Beam<2>::private_data() const;
template int Beam<2>::private_datum(std::string_view) const;
template double Beam<2>::private_value(const Local<double>&, int) const;
template void Beam<3>::output(const Local<double>&, OutputRow&) const;
template std::string Beam<3>::log(const Model&, int) const;
template std::vector<Datum> Beam<3>::private_data() const;
template int Beam<3>::private_datum(std::string_view) const;
template double Beam<3>::private_value(const Local<double>&, int) const;

}  // namespace mbcosim
