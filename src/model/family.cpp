#include "model/family.h"

#include <algorithm>

namespace mbcosim {

namespace {

constexpr std::string_view kJoint[] = {"joint"};
constexpr std::string_view kJointRegularization[] = {"jointregularization"};
constexpr std::string_view kPlateHeads[] = {"membrane4eas", "shell4eas", "shell4easans"};
constexpr std::string_view kPlateFunctions[] = {"plate", "shell", "membrane"};
constexpr std::string_view kGenel[] = {"genel"};
constexpr std::string_view kInducedVelocity[] = {"inducedvelocity", "rotor"};
constexpr std::string_view kAerodynamicHeads[] = {"aerodynamicbody",     "aerodynamicbeam",
                                                  "aerodynamicbeam2",    "aerodynamicbeam3",
                                                  "aircraftinstruments", "genericaerodynamicforce"};
constexpr std::string_view kAerodynamicFunctions[] = {"aerodynamicelement"};
constexpr std::string_view kAeromodal[] = {"aeromodal"};
constexpr std::string_view kElectric[] = {"electric"};
constexpr std::string_view kThermal[] = {"thermal"};
constexpr std::string_view kHydraulic[] = {"hydraulic"};
constexpr std::string_view kLoadable[] = {"userdefined", "loadable"};
constexpr std::string_view kBody[] = {"body"};
constexpr std::string_view kBeamHeads[] = {"beam", "beam2", "beam3", "hbeam"};
constexpr std::string_view kBeamFunctions[] = {"beam"};
constexpr std::string_view kForce[] = {"force", "couple"};
constexpr std::string_view kGravity[] = {"gravity"};
constexpr std::string_view kInertia[] = {"inertia"};
constexpr std::string_view kAutomaticStructural[] = {"automaticstructural"};
constexpr std::string_view kAirProperties[] = {"airproperties"};
constexpr std::string_view kBulk[] = {"bulk"};
constexpr std::string_view kOutputHeads[] = {"outputelement", "streamoutput", "streammotionoutput",
                                             "rtaioutput"};

constexpr TypedHead kJointTypes[] = {{"joint", "Joints"}};
constexpr TypedHead kJointRegularizationTypes[] = {
    {"jointregularization", "Joint regularizations"}};
constexpr TypedHead kGenelTypes[] = {{"genel", "Genels"}};
constexpr TypedHead kElectricTypes[] = {{"electric", "Electric elements"}};
constexpr TypedHead kThermalTypes[] = {{"thermal", "Thermal elements"}};
constexpr TypedHead kHydraulicTypes[] = {{"hydraulic", "Hydraulic elements"}};
constexpr TypedHead kLoadableTypes[] = {{"userdefined", "User defined elements"}};
constexpr TypedHead kForceTypes[] = {{"force", "Forces"}, {"couple", "Couples"}};
constexpr TypedHead kBulkTypes[] = {{"bulk", "Bulk elements"}};

constexpr std::string_view kJointFiles[] = {"jnt", "mod"};
constexpr std::string_view kGenelFiles[] = {"gen"};
constexpr std::string_view kHydraulicFiles[] = {"hyd"};
constexpr std::string_view kElectricFiles[] = {"ele"};
constexpr std::string_view kBeamFiles[] = {"act"};
constexpr std::string_view kForceFiles[] = {"frc"};
constexpr std::string_view kGravityFiles[] = {"grv"};

constexpr FamilyFacts kFamilyTable[] = {
    {Family::joint, "joint", "joints", "joints", "", kJoint, kJoint, kJointTypes, kJointFiles,
     "joint"},
    {Family::joint_regularization, "joint regularization", "joint regularizations",
     "joint regularizations", "", kJointRegularization, kJointRegularization,
     kJointRegularizationTypes},
    {Family::plate, "plate", "plates", "plates", "", kPlateHeads, kPlateFunctions},
    {Family::genel, "genel", "genels", "genels", "", kGenel, kGenel, kGenelTypes, kGenelFiles,
     "genel"},
    {.family = Family::induced_velocity,
     .name = "induced velocity element",
     .plural = "induced velocity elements",
     .count_card = "induced velocity elements",
     .old_count_card = "rotors",
     .heads = kInducedVelocity,
     .functions = kInducedVelocity,
     .rank = StageRank::collector},
    {Family::aerodynamic, "aerodynamic element", "aerodynamic elements", "aerodynamic elements", "",
     kAerodynamicHeads, kAerodynamicFunctions},
    {Family::aeromodal, "aeromodal", "aeromodals", "aeromodals", "", kAeromodal, kAeromodal},
    {Family::electric, "electric element", "electric elements", "electric elements", "", kElectric,
     kElectric, kElectricTypes, kElectricFiles, "electric"},
    {Family::thermal, "thermal element", "thermal elements", "thermal elements", "", kThermal,
     kThermal, kThermalTypes},
    {Family::hydraulic, "hydraulic element", "hydraulic elements", "hydraulic elements", "",
     kHydraulic, kHydraulic, kHydraulicTypes, kHydraulicFiles, "hydraulic"},
    {Family::loadable, "user defined element", "loadable elements", "loadable elements", "",
     kLoadable, kLoadable, kLoadableTypes},
    {Family::body, "body", "rigid bodies", "rigid bodies", "", kBody, kBody},
    {.family = Family::beam,
     .name = "beam",
     .plural = "beams",
     .count_card = "beams",
     .old_count_card = "",
     .heads = kBeamHeads,
     .functions = kBeamFunctions,
     .files = kBeamFiles,
     .owner = "beam"},
    {Family::force, "force", "forces", "forces", "", kForce, kForce, kForceTypes, kForceFiles,
     "force"},
    {.family = Family::gravity,
     .name = "gravity",
     .plural = "gravity",
     .count_card = "gravity",
     .old_count_card = "",
     .heads = kGravity,
     .functions = kGravity,
     .files = kGravityFiles,
     .owner = "gravity"},
    {.family = Family::inertia,
     .name = "inertia",
     .plural = "inertia elements",
     .count_card = "inertia",
     .old_count_card = "",
     .heads = kInertia,
     .functions = kInertia,
     .has_default_output = false},
    {.family = Family::automatic_structural,
     .name = "automatic structural",
     .plural = "automatic structural elements",
     .count_card = "",
     .old_count_card = "",
     .heads = kAutomaticStructural,
     .functions = kAutomaticStructural,
     .has_default_output = false},
    {.family = Family::air_properties,
     .name = "air properties",
     .plural = "air properties",
     .count_card = "air properties",
     .old_count_card = "",
     .heads = kAirProperties,
     .functions = kAirProperties,
     .has_label = false},
    {.family = Family::bulk,
     .name = "bulk element",
     .plural = "bulk elements",
     .count_card = "bulk elements",
     .old_count_card = "",
     .heads = kBulk,
     .functions = kBulk,
     .typed = kBulkTypes,
     .has_default_output = false},
    {.family = Family::output_element,
     .name = "output element",
     .plural = "output elements",
     .count_card = "output elements",
     .old_count_card = "rtaioutput",
     .heads = kOutputHeads,
     .functions = {},
     .has_default_output = false},
};

constexpr bool is_complete() {
  if (std::size(kFamilyTable) != kFamilies) return false;
  for (int k = 0; k < kFamilies; ++k)
    if (static_cast<int>(kFamilyTable[k].family) != k) return false;
  return true;
}
static_assert(is_complete(), "one line for each family, in the order of the enumeration");

const FamilyFacts* find(std::span<const std::string_view> FamilyFacts::*words,
                        std::string_view word) {
  for (const FamilyFacts& f : kFamilyTable)
    if (std::ranges::find(f.*words, word) != (f.*words).end()) return &f;
  return nullptr;
}

}  // namespace

const FamilyFacts& family_facts(Family family) { return kFamilyTable[static_cast<int>(family)]; }
std::span<const FamilyFacts> all_families() { return kFamilyTable; }
const FamilyFacts* family_by_head(std::string_view head) { return find(&FamilyFacts::heads, head); }
const FamilyFacts* family_by_function(std::string_view word) {
  return find(&FamilyFacts::functions, word);
}
const FamilyFacts* family_by_file(std::string_view extension) {
  return find(&FamilyFacts::files, extension);
}

}  // namespace mbcosim
