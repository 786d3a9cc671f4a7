// Every element type that a deck can name, by its name: one card each, read as any deck, its matrix
// against central differences of its residual. A word without a card fails a test.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <random>
#include <set>
#include <string>

#include "elements/families.h"
#include "elements/modal/fem_data.h"
#include "elements/modal_bodies.h"
#include "jacobian_check.h"
#include "simulation/simulation.h"
#include "solver/stages.h"
#include "solver/system.h"

namespace mbcosim {
namespace {

struct ElementCard {
  const char* word;  ///< "joint: clamp", "body"
  const char* card;  ///< "$FLUID": a fluid
};

/// All offsets, axes and frames in general position. Nodes: 1–3 dynamic, 5 and 6 without rotation,
/// 7 modal; 11–16 abstract; 21, 22 electric; 31–36 hydraulic.
const ElementCard kCards[] = {
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
     ".1,.2,.3, type, classic, 1, 89, .1,0.,.2, 0.,.1,.1, .2,.1,0., initial node, 2;"},
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
     "viscous friction coefficient, .2;"},
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
     "active, inactive, null;"},
    {"joint: total internal reaction",
     "joint: 89, total equation, 1, position, .1,.2,.3, 2, position, .3,.1,.2, position "
     "constraint, active, inactive, active, null, orientation constraint, inactive, "
     "active, inactive, null; joint: 90, total internal reaction, 2, position, .1,.1,.2, "
     "position orientation, euler, .1,.2,.3, rotation orientation, euler, .3,.2,.1, 3, "
     "position, .1,.3,.2, position orientation, euler, .2,.2,.3, rotation orientation, "
     "euler, .3,.1,.2, position constraint, active, inactive, active, orientation "
     "constraint, inactive, active, inactive, total equation, 89;"},
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
     "hydraulic: 90, dynamic control valve, 31, 32, 33, 34, const, 10., .001, .01, .01, "
     "1.e-6, .1, 100., 10., 1., $FLUID;"},
    {"hydraulic: pressure flow control",
     "hydraulic: 90, pressure flow control, 31, 32, 33, 34, 35, 36, const, 10., .001, .01, "
     ".01, 1.e-6, .1, 100., 10., 1., $FLUID;"},
    {"hydraulic: pressure flow control valve",
     "hydraulic: 90, pressure flow control valve, 31, 32, 33, 34, 35, 36, const, 10., "
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
     "gravity: uniform, 0.,.6,-.8, const, 9.81; body: 90, 1, 1.5, .1,.2,.3, diag, "
     "1.,2.,2.5;"},
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
     "force: 90, external structural, grpc, port, \"loads\", 2, 1, offset, .1,.2,.3, 2, "
     "offset, null;"},
    {"force: external structural mapping",
     "force: 90, external structural mapping, grpc, port, \"loads\", points number, 2, 1, "
     "offset, .1,.2,.3, 2, offset, .1,.2,.3;"},
    {"joint: modal", "joint: 90, modal, 7, 3, 4, no damping, \"generic.fem\", 1, 3, 2, null;"},
    {"force: modal",
     "joint: 89, modal, 7, 3, 4, no damping, \"generic.fem\", 1, 3, 2, null; force: 90, "
     "modal, 89, const, 1., const, 2., const, 3.;"},
    {"force: external modal",
     "joint: 89, modal, 7, 3, 4, no damping, \"generic.fem\", 1, 3, 2, null; force: 90, "
     "external modal, grpc, port, \"modes\", 89;"},
    {"force: external modal mapping",
     "force: 90, external modal mapping, grpc, port, \"modes\", reference node, 3, nodes number, "
     "2, "
     "1, 2, modes number, 1, sparse mapping file, \"modes\";"},
    {"output element: socket stream",
     "output element: 90, socket stream, stream name, \"out\", grpc, values, 1, drive, const, 1.;"},
    {"RTAI output", "RTAI output: 90, stream name, \"out\", grpc, values, 1, drive, const, 1.;"},
};

/// Nothing that they add to the equations depends on the state; of peers there is none here, their
/// loads are zero.
const std::set<std::string> kConstant = {"automatic structural",
                                         "couple: absolute",
                                         "couple: absolute internal",
                                         "couple: conservative",
                                         "couple: conservative internal",
                                         "electric: discrete control",
                                         "force: absolute displacement",
                                         "force: absolute internal displacement",
                                         "force: abstract",
                                         "force: abstract internal",
                                         "force: external structural",
                                         "RTAI output",
                                         "force: external modal mapping",
                                         "force: external structural mapping",
                                         "output element: socket stream",
                                         "output element: stream",
                                         "stream motion output",
                                         "stream output",
                                         "thermal: source"};

std::string nodes_of(const std::string& card) {
  std::string text =
      "structural: 1, dynamic, .1,.2,.3, euler, .3,-.2,.4, .5,.6,-.7, .8,.3,-.2;"
      "structural: 2, dynamic, 1.,-.3,.2, euler, -.1,.5,.2, -.4,.2,.1, .1,-.6,.3;"
      "structural: 3, dynamic, 2.1,.4,-.3, euler, .2,.1,-.3, .1,.2,.3, .2,.1,.4;"
      "structural: 5, dynamic displacement, .3,.1,2., .1,.2,.3;"
      "structural: 6, static displacement, 1.3,-.1,1., .3,.1,.2;";
  if (card.find("generic.fem") != card.npos)
    text += "structural: 7, modal, .2,.1,.3, euler, .1,.3,.2, .1,.2,.3, .3,.2,.1;";
  for (int label = 11; label <= 16; ++label)
    text += "abstract: " + std::to_string(label) + ", differential;";
  if (card.find("beam slider") != card.npos)
    text += "structural: 8, dynamic, .9,.2,.4, euler, .2,.3,-.1, .2,.1,.3, .1,.4,.2;";
  if (card.find("thermal") != card.npos) text += "thermal: 41, value, 3.; thermal: 42, value, 5.;";
  text += "electric: 21; electric: 22;";
  for (int label = 31; label <= 36; ++label)
    if (card.find(" " + std::to_string(label) + ",") != card.npos)
      text += "hydraulic: " + std::to_string(label) + ", 1." + std::to_string(label) + "e5;";
  return text;
}

ModelPtr read(const std::string& elements) {
  std::string card = elements;
  if (const std::size_t at = card.find("$FLUID"); at != card.npos)
    card.replace(at, 6, "fluid, linear compressible, density, 870., 1.5e9, 0., viscosity, .07");
  const std::string deck =
      "begin: data; problem: initial value; end: data;"
      "begin: initial value; initial time: 0.; final time: 1.; time step: 1e-3; end: initial value;"
      "begin: control data; skip initial joint assembly; end: control data;"
      "begin: nodes;" +
      nodes_of(card) + "end: nodes; begin: elements;" + card + "end: elements;";
  const LoadReport report =
      load_deck(BundleSource(std::map<std::string, std::string>{
                    {"deck.mbd", deck},
                    {"gains", "1. 2.\n"},
                    {"modes", "1 2 1.\n"},
                    {"generic.fem", write_fem_text(testing::generic_body(), {})}}),
                "deck.mbd");
  for (const Diagnostic& d : report.diagnostics) EXPECT_NE(d.severity, Severity::error) << d.text();
  return report.model;
}

class RegisteredElement : public ::testing::TestWithParam<ElementCard> {
 protected:
  static constexpr double kC = .02;

  /// Everything moved from the start by something like a percent of its size.
  State general_state(const Model& model) {
    State state = make_initial_state(model);
    for (int i = 0; i < model.unknowns; ++i) {
      state.y[i] += .02 * number() * std::max(1e-2, std::abs(state.y[i]));
      state.yp[i] += .1 * number();
    }
    for (NodeRotationHistory& r : state.rotation_history) {
      r.R_ref = rotation_of_vector<double>(Vec3(number(), number(), number())) * r.R_ref;
      r.w_ref += Vec3(number(), number(), number());
    }
    state.time = .5;
    state.step = 1;
    state.h = state.h_previous = 1e-3;
    update_rotations(model, state);
    const EvalContext predicted = model.context(state, Phase::step, kC, kC);
    Scratch scratch(model.scratch);
    run_after_prediction(predicted, scratch, state);
    return state;
  }
  double number() { return number_(generator_); }
  MatX matrix(const Model& model, const State& state) const {
    Workspace workspace(model);
    compute_jacobian(model.context(state, Phase::step, kC, kC), workspace);
    return model.dense(workspace.values);
  }
  static VecX residual(const Model& model, const State& state) {
    Scratch scratch(model.scratch);
    std::vector<double> r(model.unknowns);
    compute_residual(model.context(state, Phase::step, kC, kC), scratch, r);
    return Eigen::Map<const VecX>(r.data(), model.unknowns);
  }
  static VecX moved(const Model& model, State state, int column, double step) {
    std::vector<double> delta(model.unknowns, 0.0);
    delta[column] = step;
    apply_correction(model, delta, kC, kC, state);
    return residual(model, state);
  }
  /// A step of an unknown that moves its value by 1e-5 of its size.
  static double step_of(const Model& model, const State& state, int column) {
    const double size = 1e-5 * std::max(1., std::abs(state.y[column]));
    return model.kinds[column] == UnknownKind::differential ? size / kC : size;
  }

  std::mt19937 generator_{5};
  std::uniform_real_distribution<double> number_{-1, 1};
};

TEST_P(RegisteredElement, MatrixHoldsTheDerivativesOfTheResidual) {
  const ModelPtr model = read(GetParam().card);
  ASSERT_NE(model, nullptr);
  const State state = general_state(*model);
  const MatX J = matrix(*model, state);
  const auto step = [&](int column) { return step_of(*model, state, column); };
  const MatX D = central_differences(model->unknowns, step, [&](int column, double delta) {
    return moved(*model, state, column, delta);
  });
  // Rounding of residuals: what their terms are, by the matrix.
  const VecX terms =
      J.cwiseAbs() *
      (Eigen::Map<const VecX>(state.y.data(), J.cols()).cwiseAbs() / kC + VecX::Ones(J.cols()));
  for (int i = 0; i < J.rows(); ++i)
    for (int j = 0; j < J.cols(); ++j)
      EXPECT_LE(std::abs(J(i, j) - D(i, j)),
                1e-6 * std::max(std::abs(D(i, j)), 1e-3 * D.row(i).cwiseAbs().maxCoeff()) +
                    1e-14 * terms(i) / step(j))
          << GetParam().word << ": " << model->row_text(i).first << ", "
          << model->row_text(i).second << ", column " << j << " (" << model->row_text(j).first
          << "): " << J(i, j) << " against " << D(i, j);
}

TEST_P(RegisteredElement, HasAMatrixUnlessItIsKnownForNone) {
  const ModelPtr model = read(GetParam().card);
  ASSERT_NE(model, nullptr);
  const State state = general_state(*model);
  const std::vector<NodeSeeds> seeds(model->structural.size(),
                                     NodeSeeds{kC * Mat3::Identity(), Mat3::Identity()});
  const MatX J = matrix_of_elements(model->context(state, Phase::step, kC, kC), seeds);
  EXPECT_EQ(J.isZero(0), kConstant.count(GetParam().word) > 0) << GetParam().word;
}

std::string test_name(const ::testing::TestParamInfo<ElementCard>& info) {
  std::string name;
  for (const char* c = info.param.word; *c; ++c)
    name += std::isalnum(static_cast<unsigned char>(*c)) ? *c : '_';
  return name;
}
INSTANTIATE_TEST_SUITE_P(Named, RegisteredElement, ::testing::ValuesIn(kCards), test_name);

TEST(RegisteredElements, AreAllHeldByName) {
  std::set<std::string> wanted, held;
  for (const ElementCard& c : kCards) EXPECT_TRUE(held.insert(normalized(c.word)).second) << c.word;
  for (const auto& [head, entry] : full_registry().heads) {
    if (entry.types.empty()) wanted.insert(head);
    for (const auto& [type, reader] : entry.types) wanted.insert(head + ":" + type);
  }
  for (const std::string& word : wanted)
    EXPECT_EQ(held.count(word), 1u) << "no card for \"" << word << "\": add one to kCards";
  for (const std::string& word : held)
    EXPECT_EQ(wanted.count(word), 1u) << "\"" << word << "\" is no element of a deck";
}

}  // namespace
}  // namespace mbcosim
