#include "word_cards.h"

namespace mbcosim::decks {
namespace {

constexpr const char* kFluid =
    "fluid, linear compressible, density, 870., 1.5e9, 0., viscosity, .07";

struct ElementCard {
  const char* word;           ///< "joint: clamp", "body"
  const char* card;           ///< the last one has the word; "$FLUID": a fluid
  const char* solvable = "";  ///< WordCard::solvable
};

/// What a total joint is in one.
constexpr const char* kConstraintAndReaction =
    "joint: 89, total equation, 1, position, .1,.2,.3, 2, position, reference, other node, "
    ".1,.2,.3, rotation orientation, reference, other node, eye, position constraint, active, "
    "inactive, active, null, orientation constraint, inactive, active, inactive, null; joint: 90, "
    "total internal reaction, 1, position, .1,.2,.3, 2, position, reference, other node, "
    ".1,.2,.3, position constraint, active, inactive, active, orientation constraint, inactive, "
    "active, inactive, total equation, 89;";

/// All offsets, axes and frames in general position.
constexpr ElementCard kCards[] = {
    {"body", "body: 90, 1, 1.5, .1,.2,.3, diag, 1.,2.,2.5;"},
    {"beam2",
     "beam2: 90, 1, position, .1,.2,.3, orientation, euler, .1,.2,.3, 2, position, "
     ".3,.1,.2, orientation, euler, .2,.1,.1, euler, .1,.2,.1, linear viscoelastic "
     "generic, diag, 10.,20.,30.,1.,2.,3., proportional, .1;"},
    {"beam3",
     "beam3: 90, 1, position, .1,.2,.3, orientation, euler, .1,.2,.3, 2, position, "
     ".1,.1,.2, orientation, eye, 3, position, .2,.1,0., orientation, euler, .2,.1,.1, "
     "euler, .1,.2,.1, linear viscoelastic generic, diag, 10.,20.,30.,1.,2.,3., "
     "proportional, .1, same, same;"},
    {"beam",
     "beam: 90, 1, null, 2, null, 3, null, euler, .1,.2,.1, linear elastic generic, diag, "
     "10.,20.,30.,1.,2.,3., same, same;"},
    {"hbeam",
     "hbeam: 90, 1, position, .1,.2,.3, orientation, euler, .1,.2,.3, 2, position, .3,.1,.2, "
     "orientation, euler, .2,.1,.1, linear elastic generic, diag, 10.,20.,30.,1.,2.,3.;"},
    {"joint: beam slider",
     "beam3: 89, 1, null, 2, null, 3, null, euler, .1,.2,.1, linear elastic generic, diag, "
     "10.,20.,30.,1.,2.,3., same, same; joint: 90, beam slider, 8, .1,.2,.3, hinge, euler, "
     ".1,.2,.3, type, classic, 1, 89, .1,0.,.2, 0.,.1,.1, .2,.1,0., initial node, 2;",
     "beam3: 89, 1, null, 2, null, 3, null, euler, .1,.2,.1, linear elastic generic, diag, "
     "10.,20.,30.,1.,2.,3., same, same; joint: 90, beam slider, 8, null, 1, 89, .1,0.,.2, "
     "0.,.1,.1, .2,.1,0., initial node, 2;"},
    {"joint: rod bezier",
     "joint: 90, rod bezier, 1, .1,.2,.3, .4,.1,.2, 2, -.2,.3,.1, .3,.2,.1, 1.2, integration "
     "order, 3, integration segments, 2, linear viscoelastic, 10., 1.;"},
    {"joint: point contact", "joint: 90, point contact, 1, 2, .6,0.,.8, 40.;"},
    {"joint: deformable displacement hinge",
     "joint: 90, deformable displacement hinge, 1, .1,.2,.3, hinge, euler, .1,.2,.3, 2, "
     ".3,.2,.1, hinge, euler, .3,.2,.1, linear viscoelastic, 3., 2.;"},
    {"joint regularization: dynamic",
     "joint: 90, spherical hinge, 1, .1,.2,.3, 2, -.4,.5,.6; joint regularization: 90, "
     "dynamic, 1e-3;"},
    {"joint regularization: jacobian",
     "joint: 90, spherical hinge, 1, .1,.2,.3, 2, -.4,.5,.6; joint regularization: 90, "
     "jacobian, 0.;"},
    {"couple: total internal",
     "couple: 90, total internal, 1, position, .1,.2,.3, 2, position, .3,.2,.1, force, 1.,2.,3., "
     "const, 2., moment, 3.,1.,2., const, 1.;"},
    {"thermal: capacitance", "thermal: 90, capacitance, 41, 2.5;"},
    {"thermal: resistance", "thermal: 90, resistance, 41, 42, .7;"},
    {"thermal: source", "thermal: 90, source, 41, ramp, 1., 0., 1., 0.;"},
    {"bulk: spring support", "bulk: 90, spring support, 1, structural, 2, const, 3.;"},
    {"user defined: wheel2",
     "user defined: 90, wheel2, 1, .1,1.,.2, 2, .1,.2,-2.5, .1,.2,1., 2., .8, 1.2, 50., 1.25, 10., "
     "slip, linear, .3, .2, linear, .1, .4, const, .5, threshold, .3, .6;"},
    {"user defined: inline friction",
     "user defined: 90, inline friction, node1, 1, offset, .1,.2,.3, hinge, euler, .1,.2,.3, "
     "node2, 2, offset, .3,.2,.1, coulomb friction coefficient, .3, micro slip displacement, .4, "
     "viscous friction coefficient, .2;",
     "user defined: 90, inline friction, node1, 1, offset, .1,.2,.3, hinge, euler, .1,.2,.3, "
     "node2, 2, offset, -0.675715,0.973052,0.225524, coulomb friction coefficient, "
     ".3, micro slip displacement, .4, viscous friction coefficient, .2;"},
    {"user defined: asynchronous_machine",
     "user defined: 90, asynchronous_machine, rotor, 1, stator, 2, MK, 2.3, sK, .4, OmegaS, const, "
     "30., M0, .5, MP0, .3;"},
    {"joint: clamp", "joint: 90, clamp, 1, node, node;"},
    {"joint: spherical hinge", "joint: 90, spherical hinge, 1, .1,.2,.3, 2, -.4,.5,.6;"},
    {"joint: distance", "joint: 90, distance, 1, 2, const, 1.3;"},
    {"joint: distance with offset",
     "joint: 90, distance with offset, 1, .1,.2,.3, 2, .3,.1,.2, const, 1.3;"},
    {"joint: total equation",
     "joint: 90, total equation, 1, position, .1,.2,.3, position orientation, euler, "
     ".1,.2,.3, rotation orientation, euler, .3,.2,.1, 2, position, .3,.1,.2, position "
     "orientation, euler, .2,.2,.3, rotation orientation, euler, .3,.1,.2, position "
     "constraint, active, inactive, active, null, orientation constraint, inactive, "
     "active, inactive, null;",
     kConstraintAndReaction},
    {"joint: total internal reaction",
     "joint: 89, total equation, 1, position, .1,.2,.3, 2, position, .3,.1,.2, position "
     "constraint, active, inactive, active, null, orientation constraint, inactive, "
     "active, inactive, null; joint: 90, total internal reaction, 2, position, .1,.1,.2, "
     "position orientation, euler, .1,.2,.3, rotation orientation, euler, .3,.2,.1, 3, "
     "position, .1,.3,.2, position orientation, euler, .2,.2,.3, rotation orientation, "
     "euler, .3,.1,.2, position constraint, active, inactive, active, orientation "
     "constraint, inactive, active, inactive, total equation, 89;",
     kConstraintAndReaction},
    {"genel: clamp", "genel: 90, clamp, 11, abstract, algebraic, ramp, 1., 0., 1., 0.;"},
    {"genel: cross spring support",
     "genel: 90, cross spring support, 11, abstract, algebraic, 12, abstract, algebraic, "
     "linear elastic, 3.;"},
    {"genel: distance",
     "genel: 90, distance, 11, abstract, algebraic, 12, abstract, algebraic, ramp, 1., 0., "
     "1., 0.;"},
    {"genel: mass", "genel: 90, mass, 11, abstract, algebraic, 2.5;"},
    {"genel: scalar filter",
     "genel: 90, scalar filter, 11, abstract, algebraic, node dof, 12, abstract, "
     "algebraic, 2, 3., 2., 1, 1., 2.;"},
    {"genel: spring",
     "genel: 90, spring, 11, abstract, algebraic, 12, abstract, algebraic, linear elastic, "
     "3.;"},
    {"genel: spring support",
     "genel: 90, spring support, 11, abstract, algebraic, linear viscoelastic, 3., 2.;"},
    {"genel: state space MIMO",
     "genel: 90, state space MIMO, 2, 11, abstract, algebraic, 12, abstract, algebraic, 1, "
     "node dof, 1, structural, 2, algebraic, 2, matrix A, -1., 2., -3., -4., matrix B, 1., "
     "2., matrix C, 1., 2., 3., 4.;"},
    {"genel: state space SISO",
     "genel: 90, state space SISO, 11, abstract, algebraic, node dof, 12, abstract, "
     "algebraic, 2, matrix A, -1., 2., -3., -4., matrix B, 1., 2., matrix C, 1., 2.;"},
    {"genel: swash plate", "genel: 90, swash plate, 11, 12, 13, 14, 15, 16, .1;"},
    {"electric: accelerometer", "electric: 90, accelerometer, 1, 11, 1.,.2,.3, 20., .1, .7, 2.;"},
    {"electric: displacement",
     "electric: 90, displacement, 1, position, .1,.2,.3, 2, position, .3,.2,.1, 11;"},
    {"electric: motor", "electric: 90, motor, 1, 2, .6,0.,.8, 21, 22, 1.5, .2, const, .7;"},
    {"electric: discrete control",
     "electric: 90, discrete control, 1, 1, 1, 1, control, \"gains\", outputs, 11, "
     "abstract, algebraic, inputs, 12, abstract, algebraic;"},
    {"force: absolute",
     "force: 90, absolute, 1, position, .1,.2,.3, 1.,2.,3., ramp, 1., 0., 1., 0.;"},
    {"force: follower",
     "force: 90, follower, 1, position, .1,.2,.3, 1.,2.,3., ramp, 1., 0., 1., 0.;"},
    {"force: absolute displacement",
     "force: 90, absolute displacement, 5, 1.,2.,3., ramp, 1., 0., 1., 0.;"},
    {"force: absolute internal",
     "force: 90, absolute internal, 1, position, .1,.2,.3, 2, position, .3,.2,.1, "
     "1.,2.,3., const, 2.;"},
    {"force: follower internal",
     "force: 90, follower internal, 1, position, .1,.2,.3, 2, position, .3,.2,.1, "
     "1.,2.,3., const, 2.;"},
    {"force: absolute internal displacement",
     "force: 90, absolute internal displacement, 5, 6, 1.,2.,3., const, 2.;"},
    {"force: total",
     "force: 90, total, 1, position, .1,.2,.3, force orientation, euler, .1,.2,.3, moment "
     "orientation, euler, .3,.2,.1, force, 1.,2.,3., const, 2., moment, 3.,1.,2., const, "
     "1.;"},
    {"force: total internal",
     "force: 90, total internal, 1, position, .1,.2,.3, force orientation, euler, "
     ".1,.2,.3, moment orientation, euler, .3,.2,.1, 2, position, .3,.2,.1, force, "
     "1.,2.,3., const, 2., moment, 3.,1.,2., const, 1.;"},
    {"force: abstract", "force: 90, abstract, 11, abstract, ramp, 1., 0., 1., 0.;"},
    {"force: abstract internal",
     "force: 90, abstract internal, 11, abstract, 12, abstract, ramp, 1., 0., 1., 0.;"},
    {"couple: absolute", "couple: 90, absolute, 1, 1.,2.,3., const, 2.;"},
    {"couple: follower", "couple: 90, follower, 1, 1.,2.,3., const, 2.;"},
    {"couple: absolute internal", "couple: 90, absolute internal, 1, 2, 1.,2.,3., const, 2.;"},
    {"couple: follower internal", "couple: 90, follower internal, 1, 2, 1.,2.,3., const, 2.;"},
    {"force: conservative",
     "force: 90, conservative, 1, position, .1,.2,.3, 1.,2.,3., ramp, 1., 0., 1., 0.;"},
    {"force: conservative internal",
     "force: 90, conservative internal, 1, position, .1,.2,.3, 2, position, .3,.2,.1, "
     "1.,2.,3., const, 2.;"},
    {"couple: conservative", "couple: 90, conservative, 1, 1.,2.,3., const, 2.;"},
    {"couple: conservative internal",
     "couple: 90, conservative internal, 1, 2, 1.,2.,3., const, 2.;"},
    {"joint: revolute pin",
     "joint: 90, revolute pin, 1, .3,0.,0., hinge, euler, .1,.2,.3, null, hinge, euler, "
     ".3,.2,.1;"},
    {"joint: plane pin",
     "joint: 90, plane pin, 1, .3,0.,0., hinge, euler, .1,.2,.3, null, hinge, euler, "
     ".3,.2,.1;"},
    {"joint: revolute hinge",
     "joint: 90, revolute hinge, 1, .1,.0,.0, hinge, euler, .2,.3,.1, 2, .2,.1,.3, hinge, "
     "euler, .1,.1,.3;"},
    {"joint: plane hinge",
     "joint: 90, plane hinge, 1, .1,.0,.0, hinge, euler, .2,.3,.1, 2, .2,.1,.3, hinge, "
     "euler, .1,.1,.3;"},
    {"joint: revolute rotation",
     "joint: 90, revolute rotation, 1, hinge, euler, .2,.3,.1, 2, hinge, euler, .1,.1,.3;"},
    {"joint: axial rotation",
     "joint: 90, axial rotation, 1, .1,.0,.2, hinge, euler, .2,.3,.1, 2, .2,.1,.3, hinge, "
     "euler, .1,.1,.3, ramp, 1., 0., 1., 0.;"},
    {"joint: pin", "joint: 90, pin, 1, .1,.2,0., 1.,2.,3.;"},
    {"joint: spherical pin", "joint: 90, spherical pin, 1, .1,.2,0., 1.,2.,3.;"},
    {"joint: rod",
     "joint: 90, rod, 1, position, .1,.2,.3, 2, position, .3,.2,.1, 1.2, linear "
     "viscoelastic, 10., 1.;"},
    {"joint: rod with offset",
     "joint: 90, rod with offset, 1, .1,.2,.3, 2, .3,.2,.1, 1.2, linear viscoelastic, 10., "
     "1.;"},
    {"joint: total joint",
     "joint: 90, total joint, 1, position, .1,.2,.3, position orientation, euler, "
     ".1,.2,.3, rotation orientation, euler, .3,.3,.1, 2, position, .3,.1,.2, position "
     "orientation, euler, .2,.2,.3, rotation orientation, euler, .3,.3,.2, position "
     "constraint, active, velocity, inactive, component, ramp, 1., 0., 1., 0., ramp, 2., "
     "0., 1., 0., inactive, orientation constraint, active, inactive, active, component, "
     "ramp, .2, 0., 1., 0., inactive, ramp, .3, 0., 1., 0.;"},
    {"joint: total pin joint",
     "joint: 90, total pin joint, 1, position, .1,.2,.3, position orientation, euler, "
     ".1,.2,.3, rotation orientation, euler, .3,.3,.1, position, .3,.1,.2, position "
     "constraint, inactive, active, active, component, inactive, ramp, 1., 0., 1., 0., "
     "ramp, 2., 0., 1., 0., orientation constraint, active, angular velocity, inactive, "
     "component, ramp, .2, 0., 1., 0., ramp, .2, 0., 1., 0., inactive;"},
    {"joint: imposed displacement",
     "joint: 90, imposed displacement, 1, .1,.2,.3, 2, .3,.2,.1, 1.,2.,3., ramp, 1., 0., "
     "1., 0.;"},
    {"joint: imposed displacement pin",
     "joint: 90, imposed displacement pin, 1, .1,.2,.3, .3,.2,.1, 1.,2.,3., ramp, 1., 0., "
     "1., 0.;"},
    {"joint: imposed orientation",
     "joint: 90, imposed orientation, 1, euler, .1,.2,.3, 2, euler, .3,.2,.1, 1.,2.,3., "
     "ramp, .3, 0., 1., 0.;"},
    {"joint: brake",
     "scalar function: \"mu\", const, .3; joint: 90, brake, 1, .1,.2,.3, hinge, euler, "
     ".1,.2,.3, 2, .3,.2,.1, hinge, euler, .3,.2,.1, friction, .1, discrete coulomb, "
     "\"mu\", simple, const, 50.;"},
    {"joint: screw",
     "joint: 90, screw, 1, .1,.2,.3, orientation, euler, .1,.2,.3, 2, offset, .3,.2,.1, "
     "pitch, .2;"},
    {"joint: in line", "joint: 90, in line, 1, .1,.2,.3, euler, .1,.2,.3, 2, offset, .3,.2,.1;"},
    {"joint: in plane", "joint: 90, in plane, 1, .1,.2,.3, .6,.0,.8, 2, offset, .3,.2,.1;"},
    {"joint: prismatic",
     "joint: 90, prismatic, 1, hinge, euler, .1,.2,.3, 2, hinge, euler, .3,.2,.1;"},
    {"joint: drive hinge",
     "joint: 90, drive hinge, 1, hinge, euler, .1,.2,.3, 2, hinge, euler, .3,.2,.1, "
     "single, .1,.2,.3, ramp, 1., 0., 1., 0.;"},
    {"joint: drive displacement",
     "joint: 90, drive displacement, 1, .1,.2,.3, 2, .3,.2,.1, single, .1,.2,.3, ramp, 1., "
     "0., 1., 0.;"},
    {"joint: drive displacement pin",
     "joint: 90, drive displacement pin, 1, .1,.2,.3, .3,.2,.1, single, .1,.2,.3, ramp, "
     "1., 0., 1., 0.;"},
    {"joint: deformable hinge",
     "joint: 90, deformable hinge, 1, hinge, euler, .1,.2,.3, 2, hinge, euler, .3,.2,.1, "
     "linear viscoelastic, 3., 2.;"},
    {"joint: deformable displacement joint",
     "joint: 90, deformable displacement joint, 1, .1,.2,.3, hinge, euler, .1,.2,.3, 2, "
     ".3,.2,.1, hinge, euler, .3,.2,.1, linear viscoelastic, 3., 2.;"},
    {"joint: deformable joint",
     "joint: 90, deformable joint, 1, .1,.2,.3, hinge, euler, .1,.2,.3, 2, .3,.2,.1, "
     "hinge, euler, .3,.2,.1, linear viscoelastic, 3., 2.;"},
    {"joint: deformable axial joint",
     "joint: 90, deformable axial joint, 1, hinge, euler, .1,.2,.3, 2, hinge, euler, "
     ".3,.2,.1, linear viscoelastic, 3., 2.;"},
    {"joint: invariant deformable hinge",
     "joint: 90, invariant deformable hinge, 1, hinge, euler, .1,.2,.3, 2, hinge, euler, "
     ".3,.2,.1, linear viscoelastic, 3., 2.;"},
    {"joint: invariant deformable displacement joint",
     "joint: 90, invariant deformable displacement joint, 1, .1,.2,.3, hinge, euler, "
     ".1,.2,.3, 2, .3,.2,.1, hinge, euler, .3,.2,.1, linear viscoelastic, 3., 2.;"},
    {"joint: invariant deformable joint",
     "joint: 90, invariant deformable joint, 1, .1,.2,.3, hinge, euler, .1,.2,.3, 2, "
     ".3,.2,.1, hinge, euler, .3,.2,.1, linear viscoelastic, 3., 2.;"},
    {"joint: viscous body",
     "joint: 90, viscous body, 1, position, .1,.2,.3, orientation, euler, .1,.2,.3, linear "
     "viscous, 3.;"},
    {"joint: linear velocity", "joint: 90, linear velocity, 1, .6,0.,.8, ramp, 1., 0., 1., 0.;"},
    {"joint: angular velocity", "joint: 90, angular velocity, 1, .6,0.,.8, ramp, 1., 0., 1., 0.;"},
    {"joint: linear acceleration",
     "joint: 90, linear acceleration, 1, .6,0.,.8, ramp, 1., 0., 1., 0.;"},
    {"joint: angular acceleration",
     "joint: 90, angular acceleration, 1, .6,0.,.8, ramp, 1., 0., 1., 0.;"},
    {"joint: cardano hinge",
     "joint: 90, cardano hinge, 1, .1,.2,.3, hinge, euler, .1,.2,.3, 2, .3,.2,.1, hinge, "
     "euler, .3,.2,.1;"},
    {"joint: universal hinge",
     "joint: 90, universal hinge, 1, .1,.2,.3, hinge, euler, .1,.2,.3, 2, .3,.2,.1, hinge, "
     "euler, .3,.2,.1;"},
    {"joint: cardano rotation",
     "joint: 90, cardano rotation, 1, hinge, euler, .1,.2,.3, 2, hinge, euler, .3,.2,.1;"},
    {"joint: universal rotation",
     "joint: 90, universal rotation, 1, hinge, euler, .1,.2,.3, 2, hinge, euler, .3,.2,.1;"},
    {"joint: cardano pin",
     "joint: 90, cardano pin, 1, .1,.2,.3, hinge, euler, .1,.2,.3, position, .3,.2,.1, "
     "hinge, euler, .3,.2,.1;"},
    {"joint: universal pin",
     "joint: 90, universal pin, 1, .1,.2,.3, hinge, euler, .1,.2,.3, position, .3,.2,.1, "
     "hinge, euler, .3,.2,.1;"},
    {"joint: gimbal rotation",
     "joint: 90, gimbal rotation, 1, hinge, euler, .1,.2,.3, 2, hinge, euler, .3,.2,.1;"},
    {"joint regularization: tikhonov",
     "joint: 90, spherical hinge, 1, .1,.2,.3, 2, -.4,.5,.6; joint regularization: 90, "
     "tikhonov, 1e-3;"},
    {"hydraulic: actuator",
     "hydraulic: 90, actuator, 31, 32, 1, .1,.2,.3, 2, .3,.2,.1, direction, .6,0.,.8, .02, "
     ".01, 1.5, $FLUID, same;"},
    {"hydraulic: orifice", "hydraulic: 90, orifice, 31, 32, .01, 1.e-5, $FLUID;"},
    {"hydraulic: dynamic pipe", "hydraulic: 90, dynamic pipe, 31, 32, .01, 2., $FLUID;"},
    {"hydraulic: pipe", "hydraulic: 90, pipe, 31, 32, .012, 2., $FLUID;"},
    {"hydraulic: minor loss", "hydraulic: 90, minor loss, 31, 32, 1.5, 2.5, 1.e-4, $FLUID;"},
    {"hydraulic: three way minor loss",
     "hydraulic: 90, three way minor loss, 31, 32, 33, 1.5, 2.5, 1.e-4, 2.e-4, $FLUID;"},
    {"hydraulic: control valve",
     "hydraulic: 90, control valve, 31, 32, 33, 34, 1.e-4, ramp, .5, 0., 1., .1, $FLUID;"},
    {"hydraulic: control valve2",
     "hydraulic: 90, control valve 2, 31, 32, 33, 34, 1.e-4, ramp, .5, 0., 1., .1, $FLUID;"},
    {"hydraulic: dynamic control valve",
     "hydraulic: 90, dynamic control valve, 31, 32, 33, 34, const, .1, .001, .01, .01, "
     "1.e-6, .1, 100., 10., 1., $FLUID;"},
    {"hydraulic: pressure flow control",
     "hydraulic: 90, pressure flow control, 31, 32, 33, 34, 35, 36, const, .1, .001, .01, "
     ".01, 1.e-6, .1, 100., 10., 1., $FLUID;"},
    {"hydraulic: pressure flow control valve",
     "hydraulic: 90, pressure flow control valve, 31, 32, 33, 34, 35, 36, const, .1, "
     ".001, .01, .01, 1.e-6, .1, 100., 10., 1., $FLUID;"},
    {"hydraulic: pressure valve",
     "hydraulic: 90, pressure valve, 31, 32, 1.e-4, .05, 1.e-4, .01, 5.e4, 20., .01, 1.e6, "
     "10., 1., $FLUID;"},
    {"hydraulic: flow valve",
     "hydraulic: 90, flow valve, 31, 32, 33, 1.e-5, .05, 1.e-4, 2.e-4, 5.e4, 20., .01, "
     ".002, 1.e7, 10., 1., $FLUID;"},
    {"hydraulic: accumulator",
     "hydraulic: 90, accumulator, 31, .5, start, .2, .01, 1.e-4, 2., gas, 1.e5, 1.e6, 1.3, "
     "1.e6, 10., 1., $FLUID;"},
    {"hydraulic: tank",
     "hydraulic: 90, tank, 31, 32, 1.e5, 1.e-4, .1, 1., start level, .5, 1.e6, $FLUID;"},
    {"gravity",
     "body: 90, 1, 1.5, .1,.2,.3, diag, 1.,2.,2.5; gravity: uniform, 0.,.6,-.8, const, 9.81;"},
    {"inertia",
     "body: 90, 1, 1.5, .1,.2,.3, diag, 1.,2.,2.5; inertia: 90, body, all, output, always;"},
    {"automatic structural", "automatic structural: 1, 1.,2.,3.,4.,5.,6., 7.,8.,9.,1.,2.,3.;"},
    {"output element: stream",
     "output element: 90, stream, stream name, \"out\", grpc, values, 1, drive, const, 1.;"},
    {"stream output",
     "stream output: 90, stream name, \"out\", grpc, values, 1, drive, const, 1.;"},
    {"stream motion output",
     "stream motion output: 90, stream name, \"out\", grpc, output flags, position, 1;"},
    {"force: external structural",
     "force: 90, external structural, grpc, port, \"loads\", reference node, 3, labels, yes, "
     "sorted, "
     "yes, orientation, orientation vector, accelerations, yes, 2, 1, label, 7, offset, .1,.2,.3, "
     "2, offset, null;"},
    {"force: external structural mapping",
     "force: 90, external structural mapping, grpc, port, \"loads\", reference node, 3, "
     "orientation, orientation matrix, points number, 2, 1, offset, .1,.2,.3, 2, offset, "
     ".1,.2,.3, mapped points number, 1, sparse mapping file, \"points\", 5;"},
    {"joint: modal", "joint: 90, modal, 7, 3, 4, no damping, \"generic.fem\", 1, 3, 2, null;"},
    {"force: modal",
     "joint: 89, modal, 7, 3, 4, no damping, \"generic.fem\", 1, 3, 2, null; force: 90, "
     "modal, 89, const, 1., const, 2., const, 3.;"},
    {"force: external modal",
     "joint: 89, modal, 7, 3, 4, no damping, \"generic.fem\", 1, 3, 2, null; force: 90, "
     "external modal, grpc, port, \"modes\", 89;"},
    {"force: external modal mapping",
     "force: 90, external modal mapping, grpc, port, \"modes\", reference node, 3, use rigid body "
     "forces, yes, rotate rigid body forces, yes, type, all, nodes number, 2, 1, 2, modes number, "
     "1, sparse mapping file, threshold, 1e-9, \"modes\";"},
    {"output element: socket stream",
     "output element: 90, socket stream, stream name, \"out\", grpc, values, 1, drive, const, 1.;"},
    {"RTAI output", "RTAI output: 90, stream name, \"out\", grpc, values, 1, drive, const, 1.;"},
};

}  // namespace

std::vector<WordCard> element_cards() {
  std::vector<WordCard> all;
  for (const ElementCard& c : kCards) {
    std::string text(c.card, std::string(c.card).size() - 1);  // without the last semicolon
    if (const std::size_t at = text.find("$FLUID"); at != text.npos) text.replace(at, 6, kFluid);
    const std::size_t end = text.rfind("; ");
    WordCard& card = all.emplace_back();
    card.word = c.word;
    card.solvable = c.solvable;
    if (end != text.npos) card.before = text.substr(0, end + 1);
    card.card = end == text.npos ? text : text.substr(end + 2);
  }
  return all;
}

}  // namespace mbcosim::decks
