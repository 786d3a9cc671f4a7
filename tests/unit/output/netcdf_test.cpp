/// NetCDF results, read back with the C library.
#include <netcdf.h>
#include <unistd.h>

#include <complex>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "deck_run.h"
#include "output/result_files.h"

namespace mbcosim::netcdf_test {
namespace {

const char* const kDeck = R"(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: .05; time step: 1e-2; max iterations: 20; tolerance: 1e-9;
  derivatives tolerance: 1e-3; eigenanalysis: list, 2, 0., .02, parameter, .1, output full matrices, output eigenvectors, output geometry;
end: initial value;
begin: control data; structural nodes: 3; rigid bodies: 2; joints: 2; forces: 2; gravity; default output: all, accelerations;
  output results: netcdf, no text; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, 1.,0.,0., eye, null, null, accelerations, yes;
  structural: 7, dynamic, 0.,1.,0., eye, orientation description, orientation matrix, null, 0.,0.,2.;
end: nodes;
begin: elements;
  body: 2, 2, 1.5, null, eye;
  body: 7, 7, 1., null, eye;
  joint: 1, clamp, 1, node, node;
  joint: 3, rod, 1, 2, 1., linear elastic, 1000.;
  force: 4, absolute, 2, position, 0.,.5,0., 0.,1.,0., const, 3.;
  couple: 5, absolute, 7, 0.,0.,1., const, .5;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)";

class NetcdfResults : public testing::Test {
 protected:
  virtual std::string deck() const { return kDeck; }
  void SetUp() override {
    prefix_ = testing::TempDir() + "mbcosim_netcdf_" +
              std::to_string(testing::UnitTest::GetInstance()->random_seed()) + "_" +
              std::to_string(reinterpret_cast<std::uintptr_t>(this));
    const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck()}}), "deck.mbd");
    for (const Diagnostic& d : report.diagnostics)
      EXPECT_NE(d.severity, Severity::error) << d.text();
    ASSERT_TRUE(report.ok());
    auto writer = make_result_writer(*report.model, prefix_);
    auto simulation = Simulation::create(report.model, nullptr, writer);
    ASSERT_TRUE(simulation) << simulation.error().message;
    simulation_ = std::move(*simulation);
    const StepReport run = simulation_->run_until(0.05);
    ASSERT_FALSE(run.error) << run.error->message;
    const Status written = writer->finish();
    ASSERT_TRUE(written) << written.error().message;
    ASSERT_EQ(nc_open((prefix_ + ".nc").c_str(), NC_NOWRITE, &file_), NC_NOERR);
  }
  void TearDown() override {
    nc_close(file_);
    for (const char* end : {".nc", ".out", ".log", "_0.m", "_1.m"})
      std::remove((prefix_ + end).c_str());
  }
  int id(const std::string& name) {
    int variable = -1;
    EXPECT_EQ(nc_inq_varid(file_, name.c_str(), &variable), NC_NOERR) << name;
    return variable;
  }
  std::vector<std::size_t> shape(const std::string& name) {
    int dimensions[8], count = 0;
    EXPECT_EQ(nc_inq_var(file_, id(name), nullptr, nullptr, &count, dimensions, nullptr), NC_NOERR);
    std::vector<std::size_t> lengths(count);
    for (int k = 0; k < count; ++k) nc_inq_dimlen(file_, dimensions[k], &lengths[k]);
    return lengths;
  }
  std::vector<double> values(const std::string& name) {
    std::size_t size = 1;
    for (const std::size_t n : shape(name)) size *= n;
    std::vector<double> data(size);
    EXPECT_EQ(nc_get_var_double(file_, id(name), data.data()), NC_NOERR) << name;
    return data;
  }
  std::string text(const std::string& variable, const char* attribute) {
    std::size_t length = 0;
    const int v = id(variable);
    if (nc_inq_attlen(file_, v, attribute, &length) != NC_NOERR) return "";
    std::string s(length, ' ');
    nc_get_att_text(file_, v, attribute, s.data());
    return s;
  }

  std::string prefix_;
  std::unique_ptr<Simulation> simulation_;
  int file_ = -1;
};

using Shape = std::vector<std::size_t>;

TEST_F(NetcdfResults, HaveOneValueForEachRecord) {
  EXPECT_EQ(values("run.step"), (std::vector<double>{0, 1, 2, 3, 4, 5}));
  EXPECT_NEAR(values("time").back(), 0.05, 1e-12);
  EXPECT_EQ(values("run.timestep")[1], 0.01);
  EXPECT_EQ(shape("node.struct.2.X"), (Shape{6, 3}));
  EXPECT_EQ(shape("node.struct.7.R"), (Shape{6, 3, 3}));
  EXPECT_EQ(shape("elem.joint.3.l"), (Shape{6}));
}

TEST_F(NetcdfResults, AreThoseOfTheSimulation) {
  const Model& model = simulation_->model();
  const EvalContext context = model.context(simulation_->state(), Phase::step);
  const NodeState n2 = model.node_state(context, 1), n7 = model.node_state(context, 2);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(values("node.struct.2.X")[15 + i], n2.x(i));
    EXPECT_EQ(values("node.struct.2.XP")[15 + i], n2.v(i));
    EXPECT_EQ(values("node.struct.7.Omega")[15 + i], n7.w(i));
    for (int j = 0; j < 3; ++j) EXPECT_EQ(values("node.struct.7.R")[45 + 3 * i + j], n7.R(i, j));
  }
  EXPECT_NEAR(values("node.struct.2.XPP")[15 + 2], -9.81, 1e-2);
  EXPECT_EQ(values("elem.force.4.F")[1], 3);
  EXPECT_EQ(values("elem.force.4.Arm")[1], .5);
  EXPECT_EQ(values("elem.couple.5.M")[2], .5);
  EXPECT_EQ(shape("elem.joint.3.F"), (Shape{6, 3}));
  EXPECT_EQ(shape("node.struct.2.B"), (Shape{6, 3}));
  EXPECT_EQ(shape("node.struct.2.E"), (Shape{6, 3}));
}

/// How many records a reader finds in the file of a run that goes on.
std::size_t records_during_a_run(const std::string& option) {
  std::string deck = kDeck;
  deck.replace(deck.find(", no text"), 9, option);
  const std::size_t analysis = deck.find("eigenanalysis");  // rewrites the header
  deck.erase(analysis, deck.find(';', analysis) + 1 - analysis);
  const std::string prefix =
      testing::TempDir() + "mbcosim_netcdf_open_" + std::to_string(::getpid());
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
  EXPECT_TRUE(report.ok());
  const auto writer = make_result_writer(*report.model, prefix);
  const auto simulation = Simulation::create(report.model, nullptr, writer);
  EXPECT_TRUE(simulation);
  EXPECT_FALSE((*simulation)->step_many(2).error);
  int file = -1, dimension = -1;
  std::size_t records = 0;
  EXPECT_EQ(nc_open((prefix + ".nc").c_str(), NC_NOWRITE, &file), NC_NOERR);
  EXPECT_EQ(nc_inq_dimid(file, "time", &dimension), NC_NOERR);
  EXPECT_EQ(nc_inq_dimlen(file, dimension, &records), NC_NOERR);
  nc_close(file);
  EXPECT_TRUE(writer->finish());
  for (const char* end : {".nc", ".out", ".log", ".mov", ".ine", ".jnt", ".frc"})
    std::remove((prefix + end).c_str());
  return records;
}

TEST(NetcdfSync, LetsReadersSeeEachRecordAsSoonAsItIsWritten) {
  EXPECT_EQ(records_during_a_run(", sync"), 3u);  // those of the start and of two steps
  EXPECT_LT(records_during_a_run(", sync, no sync"), 3u);
}

TEST_F(NetcdfResults, DescribeThemselves) {
  EXPECT_EQ(values("node.struct"), (std::vector<double>{1, 2, 7}));
  EXPECT_EQ(values("elem.joint"), (std::vector<double>{1, 3}));
  EXPECT_EQ(values("elem.couple"), (std::vector<double>{5}));
  EXPECT_EQ(text("node.struct.2", "type"), "dynamic");
  EXPECT_EQ(text("node.struct.2.XP", "units"), "m/s");
  EXPECT_EQ(text("time", "units"), "s");
  EXPECT_EQ(text("node.struct.7.R", "units"), "");
}

TEST_F(NetcdfResults, HoldEigenanalyses) {
  EXPECT_EQ(values("eig.1.step"), std::vector<double>{2});
  EXPECT_EQ(values("eig.0.dCoef"), std::vector<double>{.05});
  EXPECT_EQ(shape("eig.0.step"), Shape{1});
  const std::size_t n = simulation_->model().unknowns, m = shape("eig.0.alpha")[0];
  EXPECT_EQ(shape("eig.0.alpha"), (Shape{m, 3}));
  EXPECT_EQ(shape("eig.0.Aplus"), (Shape{n, n}));
  EXPECT_EQ(shape("eig.0.VR"), (Shape{2, m, n}));
}

/// beta Aminus v = alpha Aplus v tells that rows, columns, modes and parts are where readers
/// (Blendyn 2026 among them) look for them.
TEST_F(NetcdfResults, HoldEigenpairsOfTheirMatrices) {
  using Complex = std::complex<double>;
  const std::vector<double> ratio = values("eig.0.alpha"), v = values("eig.0.VR"),
                            plus = values("eig.0.Aplus"), minus = values("eig.0.Aminus");
  const std::size_t n = simulation_->model().unknowns, m = ratio.size() / 3;
  ASSERT_GT(m, 4u);
  for (std::size_t k = 0; k < m; ++k) {
    const Complex alpha(ratio[3 * k], ratio[3 * k + 1]);
    for (std::size_t i = 0; i < n; ++i) {
      Complex sum = 0;
      double size = 0;
      for (std::size_t j = 0; j < n; ++j) {
        const Complex entry = ratio[3 * k + 2] * minus[i * n + j] - alpha * plus[i * n + j];
        sum += entry * Complex(v[k * n + j], v[(m + k) * n + j]);
        size += std::abs(entry);
      }
      EXPECT_LE(std::abs(sum), 1e-10 * size) << "mode " << k << ", equation " << i;
    }
  }
}

TEST_F(NetcdfResults, TellWhereTheUnknownsOfEachNodeBegin) {
  const std::vector<double> first = values("eig.idx");
  ASSERT_EQ(shape("eig.idx"), shape("node.struct"));
  for (std::size_t k = 0; k < first.size(); ++k)
    EXPECT_EQ(first[k], simulation_->model().structural[k].first);
}

/// Readers take the first axis of each variable for granted.
TEST_F(NetcdfResults, HaveAnAxisInEachVariable) {
  int count = 0;
  ASSERT_EQ(nc_inq_nvars(file_, &count), NC_NOERR);
  for (int k = 0; k < count; ++k) {
    char name[NC_MAX_NAME + 1];
    int axes = 0;
    ASSERT_EQ(nc_inq_var(file_, k, name, nullptr, &axes, nullptr, nullptr), NC_NOERR);
    EXPECT_GE(axes, 1) << name;
  }
}

/// `custom output` of beams; the lines of .act keep their columns.
class NetcdfBeams : public NetcdfResults {
 protected:
  std::string deck() const override {
    return initial_value_block(1e-2, .05,
                               "max iterations: 20; tolerance: 1e-9; derivatives tolerance: 1e9;") +
           R"(
begin: control data; structural nodes: 3; beams: 4; joints: 1; forces: 1; output results: netcdf; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, static, .5,0.,0., eye, null, null;
  structural: 3, static, 1.,0.,0., eye, null, null;
end: nodes;
constitutive law: 1, 6, linear viscoelastic generic, diag, 1e3,1e3,1e3,10.,10.,10., proportional, 1e-2;
begin: elements;
  joint: 1, clamp, 1, node, node;
  beam3: 1, 1, null, 2, null, 3, null, eye, reference, 1, same, same;
  beam3: 2, 1, null, 2, null, 3, null, eye, reference, 1, same, same, custom output, all;
  beam2: 3, 1, null, 3, null, eye, reference, 1, custom output, position, orientation,
    orientation description, orientation vector, strains;
  beam2: 4, 1, null, 3, null, eye, linear elastic, 1., custom output, all;
  force: 1, absolute, 3, position, null, 1.,2.,3., ramp, 1., 0., forever, 0.;
end: elements;
)";
  }
  bool has(const std::string& name) {
    int variable = -1;
    return nc_inq_varid(file_, name.c_str(), &variable) == NC_NOERR;
  }
};

TEST_F(NetcdfBeams, HaveTheFieldsThatWereChosen) {
  for (const char* name : {"F_I", "M_I", "F_II", "M_II"})
    EXPECT_TRUE(has(std::string("elem.beam.1.") + name)) << name;
  for (const char* name : {"X_I", "E_I", "nu_I", "k_I", "nuP_I", "kP_II"}) {
    EXPECT_FALSE(has(std::string("elem.beam.1.") + name)) << name;
    EXPECT_TRUE(has(std::string("elem.beam.2.") + name)) << name;
  }
  for (const char* name : {"X", "Phi", "nu", "k"})
    EXPECT_TRUE(has(std::string("elem.beam.3.") + name)) << name;
  for (const char* name : {"F", "M", "E", "nuP"})
    EXPECT_FALSE(has(std::string("elem.beam.3.") + name)) << name;
  EXPECT_TRUE(has("elem.beam.4.k"));
  EXPECT_FALSE(has("elem.beam.4.kP"));  // elastic
  EXPECT_EQ(shape("elem.beam.2.X_I"), (Shape{6, 3}));
}

TEST_F(NetcdfBeams, HoldThePrivateData) {
  const ElementRef beam = simulation_->model().find_element(Family::beam, 2);
  const EvalContext context = simulation_->model().context(simulation_->state(), Phase::step);
  const std::pair<const char*, const char*> pairs[] = {{"X_II", "pII.Xx"},   {"nu_I", "pI.ex"},
                                                       {"k_II", "pII.kx"},   {"nuP_I", "pI.ePx"},
                                                       {"kP_II", "pII.kPx"}, {"F_II", "pII.Fx"}};
  for (const auto& [variable, datum] : pairs) {
    const std::vector<double> data = values(std::string("elem.beam.2.") + variable);
    const int first = beam.set->private_datum(beam.index, datum);
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ(data[15 + i], beam.set->private_value(context, beam.index, first + i)) << variable;
  }
}

/// `default beam output` stands for the beams that have no `custom output`.
class NetcdfDefaultBeams : public NetcdfBeams {
 protected:
  std::string deck() const override {
    std::string text = NetcdfBeams::deck();
    const std::string card = "output results: netcdf;";
    text.insert(text.find(card),
                "default beam output: orientation, orientation description, orientation matrix, "
                "linear strain, strain rates;\n  ");
    const std::string own = ", linear elastic, 1., custom output, all";
    text.replace(text.find(own), own.size(), ", linear elastic, 1.");
    return text;
  }
};

class NetcdfBeamsInAllFields : public NetcdfBeams {
 protected:
  std::string deck() const override {
    std::string text = NetcdfBeams::deck();
    const std::string card = "output results: netcdf;";
    text.insert(text.find(card),
                "default beam output: all, orientation description, orientation vector; ");
    return text;
  }
};

TEST_F(NetcdfBeamsInAllFields, HaveTheOrientationDescriptionThatWasAskedFor) {
  for (const char* name : {"X_I", "Phi_I", "F_I", "M_I", "nu_I", "k_I", "nuP_I", "kP_I"})
    EXPECT_TRUE(has(std::string("elem.beam.1.") + name)) << name;
  EXPECT_FALSE(has("elem.beam.1.E_I"));
  EXPECT_TRUE(has("elem.beam.2.E_I"));
}

TEST_F(NetcdfDefaultBeams, HaveTheFieldsOfTheControlCard) {
  for (const char* name : {"R_I", "nu_I", "nuP_I", "kP_I", "R_II"})
    EXPECT_TRUE(has(std::string("elem.beam.1.") + name)) << name;
  for (const char* name : {"X_I", "F_I", "M_I", "k_I", "E_I"})
    EXPECT_FALSE(has(std::string("elem.beam.1.") + name)) << name;
  for (const char* name : {"X_I", "E_I", "F_I", "M_I", "nu_I", "k_I", "nuP_I", "kP_II"})
    EXPECT_TRUE(has(std::string("elem.beam.2.") + name)) << name;
  EXPECT_TRUE(has("elem.beam.3.Phi"));
  EXPECT_FALSE(has("elem.beam.3.R"));
  EXPECT_TRUE(has("elem.beam.4.nu"));
  EXPECT_FALSE(has("elem.beam.4.nuP"));  // elastic
  EXPECT_EQ(shape("elem.beam.1.R_I"), (Shape{6, 3, 3}));
}

TEST_F(NetcdfResults, StandBesideTheTextFiles) {
  EXPECT_TRUE(std::filesystem::exists(prefix_ + ".mov"));
  EXPECT_TRUE(std::filesystem::exists(prefix_ + ".out"));
}

}  // namespace
}  // namespace mbcosim::netcdf_test
