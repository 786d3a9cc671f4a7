#include "input/grammar/texts.h"

namespace mbcosim::grammar {

const char* const kNodes = R"(
@ node | <word> : <label> , [ name , "<name>" , ] <grammar> [ , scale , { default | <scale> } ] [ , output , <yes or no> ] ;
structural
  = { { static | dynamic } , [ position , ] <position> , [ orientation , ] <absolute orientation> , [ orientation description , <orientation description> , ] [ velocity , ] <velocity> , [ angular velocity , ] <angular velocity> [ , assembly , <position stiffness> , <velocity stiffness> , <yes or no> ] | modal , <position> , <absolute orientation> , <velocity> , <angular velocity> | static displacement , [ position , ] <position> , [ velocity , ] <velocity> | dynamic displacement , [ position , ] <position> , [ velocity , ] <velocity> [ , assembly , <position stiffness> , <velocity stiffness> ] [ , accelerations , <yes or no> ] [ , output inertia , <yes or no> ] | dynamic , <position> , <absolute orientation> , <velocity> , <angular velocity> [ , prediction node , <node> ] [ , scale , { default | <scale> } ] [ , output , <yes or no> ] [ , accelerations , <yes or no> ] [ , output inertia , <yes or no> ] | dummy , <node> , offset , <offset> , <orientation> [ , orientation description , <orientation description> ] | dummy , <node> , relative frame , <node 2> [ , position , <offset> ] [ , orientation , <orientation> [ , orientation description , <orientation description> ] ] [ , pivot node , <node 3> [ , position , <offset> ] [ , orientation , <orientation> ] ] }
  > .mov: x [m] (3), orientation (3 or 9), v [m/s] (3), w [rad/s] (3) [, a (3), dw/dt (3)]; .ine: momentum (3), momenta moment (3), their rates (6)
  ! yes: static, dynamic, modal, dummy, displacement
abstract
  = [ { algebraic , } [ value , ] <x> | differential , [ value , ] <x> [ , derivative , <rate> ] | [ value , ] <x> ]
  > .abs: x [, dx/dt]
electric
  = [ value , <V [V]> [ , derivative , <rate [V/s]> ] ]
  > .ele: V, dV/dt
hydraulic
  = [ value , <p [Pa]> ]
  > .prs: p
thermal
  = [ value , <T [K]> [ , derivative , <rate [K/s]> ] ]
  > .thn: T, dT/dt
parameter
  = [ value , <x> | element | sample and hold , <abstract node> , abstract , <period [s]> | beam strain gage , <y [m]> , <z [m]> ]
  > .prm: x
)";

const char* const kElements = R"(
@ element | <word> : <label> , [ name , "<name>" , ] <grammar> [ , output , <yes or no> ] ;
automatic structural
  : automatic structural : <grammar> ;
  = <node> , <vec3> , <vec3> , <vec3> , <vec3>
beam3
  = <node 1> , [ position , ] <offset> , [ { orientation | rot } , <orientation> , ] <node 2> , [ position , ] <offset> , [ { orientation | rot } , <orientation> , ] <node 3> , [ position , ] <offset> , [ { orientation | rot } , <orientation> , ] { from nodes | <absolute orientation> } , <law 6> , { same | from nodes | [ orientation , ] <absolute orientation> } , { same | <law 6> } [ , piezoelectric actuator , <n actuators> , ( <abstract node> ) * n actuators , <6 rows> , { same | <6 rows> } ] [ , custom output , <beam output> ]
  > .act: F [N] (3), M [N m] (3) at each section, in its frame
beam
  = <node 1> , <offset> , <node 2> , <offset> , <node 3> , <offset> , from nodes , <law 6> , same , same
  > .act: as `beam3`
beam2
  = <node 1> , [ position , ] <offset> , [ { orientation | rot } , <orientation> , ] <node 2> , [ position , ] <offset> , [ { orientation | rot } , <orientation> , ] { from nodes | <absolute orientation> } , <law 6> [ , piezoelectric actuator , <n actuators> , ( <abstract node> ) * n actuators , <6 rows> ] [ , custom output , <beam output> ]
  > .act: F [N] (3), M [N m] (3), in the section's frame
hbeam
  = <node 1> , <offset> , [ { orientation | rot } , <orientation> , ] <node 2> , <offset> , [ { orientation | rot } , <orientation> , ] <elastic law 6>
  > .act: as `beam2`
bind
  : bind : <grammar> ;
  = { <joint> , joint , <element parameter node> , { { string | name } , "<private datum>" | [ index , ] <n datum> } }
body
  = <node> , { condense , 2 , ( <mass [kg]> , <offset> , <inertia> [ , { inertial | orientation } , { node | <orientation> } ] ) * 2 | [ allow negative mass , ] <mass [kg]> , <offset> , <inertia> [ , { inertial | orientation } , { node | <orientation> } ] | variable mass , <drive> , <vec3 drive> , <mat3 drive> , <mat3 drive> }
  ! yes: also `condense`, `variable mass`; `orientation` is a newer word for `inertial`
bulk
  = <type of the bulk group>
couple
  = <type of the couple group>
driven
  = <drive> , [ hint , "<hint>" , ] { <element card> | existing : <head> , <label> }
  ! partly: hints: `offset` and `hinge` of joints, `drive`, `drive3`, `position-drive3`, `orientation-drive3` with any drive that keeps no state of its own; others are named in a warning; with `existing` only `offset` and `hinge`
electric
  = <type of the electric group>
force
  = <type of the force group>
genel
  = <type of the genel group>
gravity
  : gravity : <grammar> ;
  = { [ uniform , ] <vec3 drive> | central , [ origin , <position> , ] mass , <mass [kg]> , G , { si | <G [m3/(kg s2)]> } } [ , output , <yes or no> ]
  > .grv: acceleration (3)
  ! yes: without label
hydraulic
  = <type of the hydraulic group>
inertia
  = [ position , <position> , ] [ orientation , <absolute orientation> , ] { body , all | joint , <joint> | user defined , all } [ , output , { no | yes | log | both | always } ]
joint
  = <type of the joint group>
joint regularization
  = <type of the jointregularization group>
  ! yes: signs of the rows as in the reference solver: with some joints (revolute and spherical ones) it drives the points apart instead of giving way
output
  : output : <grammar> ;
  = <head> , { <label> | range , <first label> , <last label> }
output element
  = { stream | socket stream } , <stream>
RTAI output
  = <stream>
stream output
  = <stream>
stream motion output
  = <stream>
thermal
  = <type of the thermal group>
user defined
  = <type of the userdefined group>

@ force | force : <label> , <word> , <grammar> [ , output , <yes or no> ] ;
absolute
  = <node> , { position , <offset> , <vec3 drive> | <direction> , <offset> , <drive> }
  > .frc: node, F [N] (3), point of application (3)
conservative
  = <node> , { position , <offset> , <vec3 drive> | <direction> , <offset> , <drive> }
  > .frc: as `absolute`
follower
  = <node> , { position , <offset> , <vec3 drive> [ , output relative ] | <direction> , <offset> , <drive> }
  > .frc: as `absolute`
absolute internal
  = <node 1> , position , <offset> , <node 2> , position , <offset> , <vec3 drive>
  > .frc: node 1, F (3), point (3), node 2, -F (3), point (3)
conservative internal
  = <node 1> , position , <offset> , <node 2> , position , <offset> , <vec3 drive>
  > .frc: as `absolute internal`
follower internal
  = <node 1> , position , <offset> , <node 2> , position , <offset> , <vec3 drive>
  > .frc: as `absolute internal`
absolute displacement
  = { <node> | <displacement node> } , <vec3 drive>
  > .frc: node, F (3), point (3)
absolute internal displacement
  = <node 1> , <node 2> , <vec3 drive>
  > .frc: as `absolute internal`
total
  = <node> [ , position , <offset> ] [ , force orientation , <orientation> ] [ , moment orientation , <orientation> ] [ , force , <vec3 drive> ] [ , moment , <vec3 drive> ]
  > .frc: F (3), M (3)
total internal
  = <node 1> [ , position , <offset> ] [ , force orientation , <orientation> ] [ , moment orientation , <orientation> ] , <node 2> [ , position , <offset> ] [ , force orientation , <orientation> ] [ , moment orientation , <orientation> ] [ , force , <vec3 drive> ] [ , moment , <vec3 drive> ]
  > .frc: F (3), M (3), their components in the frames of the card (6)
abstract
  = <equation> , <drive>
  > .frc: node, value
abstract internal
  = <equation> , <equation 2> , <drive>
  > .frc: node 1, value, node 2, -value
modal
  = <modal joint> , [ list , <n modes> , ( <mode> ) * n modes , ] ( <drive> [ , resultant , <vec3> , <vec3> ] ) * 2
  > .frc: F (3), M (3), value of each drive
external structural
  = <communicator> , [ reference node , <node 3> , ] [ labels , <yes or no> , ] [ sorted , { yes } , ] [ orientation , { none | orientation matrix | orientation vector | euler 123 } , ] [ accelerations , <yes or no> , ] <n points> , ( <node> [ , label , <label> ] [ , offset , <offset> ] ) * n points [ , echo , "<file>" ] [ , kinematics ]
  > .frc: label@node F (3) M (3); with a reference node its line first
  ! yes: `grpc, port, "<name>"`: a port of the daemon, to which peers attach; that form has neither `echo` nor coupling `none`
external structural mapping
  = <communicator> , [ orientation , orientation matrix , ] points number , 1 , <node> , offset , <offset> [ , mapped points number , { from file | 1 } , { full | sparse } mapping file , "<mapping>" ]
  > .frc: label@node F (3) M (3)
  ! partly: no `membrane` (nodes of membrane elements, which are not served), no `echo` (the input of a tool that makes the matrix; write the matrix into the mapping file)
external modal
  = <communicator> , { <modal joint> [ , accelerations ] [ , type , { rigid | modal | all } ] | reference node , <node> [ , accelerations ] [ , type , rigid ] }
  > .frc: label#node F (3) M (3), label.mode force
external modal mapping
  = <communicator> , [ reference node , <node 3> , [ use rigid body forces , <yes or no> [ , rotate rigid body forces , <yes or no> ] , ] ] [ type , modal , ] nodes number , 2 , <node 1> , <node 2> , modes number , { from file | 3 } , { full | sparse } mapping file , [ threshold , <threshold> , ] "<modes>"

@ couple | couple : <label> , <word> , <grammar> [ , output , <yes or no> ] ;
absolute
  = <node> , [ position , <offset> , ] <vec3 drive>
  > .frc: node, M [N m] (3)
conservative
  = <node> , [ position , <offset> , ] <vec3 drive>
  > .frc: as `absolute`
follower
  = <node> , [ position , <offset> , ] <vec3 drive>
  > .frc: as `absolute`
absolute internal
  = <node 1> , [ position , <offset> , ] <node 2> , [ position , <offset> , ] <vec3 drive>
  > .frc: node 1, M (3), node 2, -M (3)
conservative internal
  = <node 1> , [ position , <offset> , ] <node 2> , [ position , <offset> , ] <vec3 drive>
  > .frc: as `absolute internal`
follower internal
  = <node 1> , [ position , <offset> , ] <node 2> , [ position , <offset> , ] <vec3 drive>
  > .frc: as `absolute internal`
total internal
  = <node 1> [ , position , <offset> ] [ , force orientation , <orientation> ] [ , moment orientation , <orientation> ] , <node 2> [ , position , <offset> ] [ , force orientation , <orientation> ] [ , moment orientation , <orientation> ] [ , force , <vec3 drive> ] [ , moment , <vec3 drive> ]
  > .frc: as the force

@ genel | genel : <label> , <word> , <grammar> [ , output , <yes or no> ] ;
clamp
  = { <abstract dof> , <drive> | <abstract node> , abstract , differential , <drive> | <node> , structural , 1 , algebraic , <drive> | <hydraulic node> , hydraulic , <drive> }
  > .gen: multiplier
distance
  = <abstract dof> , <abstract dof 2> , <drive>
  > .gen: multiplier
spring
  = <abstract dof> , <abstract dof 2> , <elastic law 1>
spring support
  = <abstract dof> , <law 1> [ , position , { from node | <x> } ]
cross spring support
  = <abstract dof> , <abstract dof 2> , <law 1>
mass
  = <abstract dof> , <drive>
scalar filter
  = <abstract dof> , <scalar value> , [ canonical form , { controllable | observable } , ] 2 , <d1> , <d2> , 1 , <n0> , <n1> [ , gain , <gain> ] [ , balance , <yes or no> ]
  > .gen: states, rates
state space SISO
  = <abstract dof> , <scalar value> , 1 , [ matrix E , <e> , ] matrix A , <a> , matrix B , <b> , matrix C , <c> [ , matrix D , <d> ] [ , gain , <gain> ] [ , balance , <yes or no> ] [ , value , <x> ]
  > .gen: states, rates
state space MIMO
  = 1 , <abstract dof> , 1 , <scalar value> , 1 , [ matrix E , <e> , ] matrix A , <a> , matrix B , <b> , matrix C , <c> [ , matrix D , <d> ] [ , gain , <gain> ] [ , balance , <yes or no> ] [ , value , <x> ]
  > .gen: states, rates
swash plate
  = <abstract node> , [ limits , <lower> , <upper> , ] <abstract node 2> , [ limits , <lower> , <upper> , ] <abstract node 3> , [ limits , <lower> , <upper> , ] <abstract node 4> , <abstract node 5> , <abstract node 6> [ , <time constant [s]> [ , <cyclic factor> , <collective factor> ] ]

@ electric | electric : <label> , <word> , <grammar> [ , output , <yes or no> ] ;
accelerometer
  = { translational , <node> , <abstract node> , <direction> [ , position , <offset> ] | rotational , <node> , <abstract node> , <direction> | <node> , <abstract node> , <direction> , <natural frequency [rad/s]> , <time constant [s]> , <damping ratio> , <gain> }
displacement
  = <node 1> , [ position , ] <offset> , <node 2> , [ position , ] <offset> , <abstract node>
motor
  = <node 1> , <node 2> , { <direction> | orientation , <orientation> } , <electric node> , <electric node 2> , <torque gain [N m/A]> , <inductance [H]> , <drive> [ , initial current , <current [A]> ]
  > .nc: M, Omega, i, iP, V1, V2
  ! yes: its results go to NetCDF, not to `.ele`; the resistance is a drive of the magnitude of the current
discrete control
  = 1 , 1 , <n order> , [ fir , <n order of B> , ] <n steps between samples> , { identification , { arx | armax } [ , forgetting factor , { const , <fraction> | dynamic , <n1> , <n2> , <rho> , <fact> , <kref> , <klim> } ] [ , excitation , <drive> ] [ , file , "<table>" ] | adaptive control , { arx | armax } , [ periodic , <n factor> , ] { gpc , 2 , 1 , 0 , [ prediction weights , 1. , 1. , ] [ control weights , 1. , ] <drive> | deadbeat , 2 , 1 } [ , trigger , <drive> ] [ , desired output , <drive> ] } , outputs , <scalar value> [ , scale , <drive> ] , inputs , <abstract dof>
  > PREFIX.<file>: a line for each sample
  ! yes: `control` with the matrices of a file; `identification`; `adaptive control` by `gpc` and `deadbeat`; `file`: a line for each sample in `PREFIX.<name>`; no result line, its private data are `u[1]`, `u[2]`, …, of an identified model `theta[1]`, … (the numbers of the line) and `forgetting`

@ thermal | thermal : <label> , <word> , <grammar> [ , output , <yes or no> ] ;
capacitance
  = <thermal node> , <C [J/K]>
resistance
  = <thermal node> , <thermal node 2> , <R [K/W]>
source
  = <thermal node> , <drive>

@ bulk | bulk : <label> , <word> , <grammar> [ , output , <yes or no> ] ;
spring support
  = <equation> , <drive>

@ userdefined | user defined : <label> , <word> , [ help , ] <grammar> [ , output , <yes or no> ] ;
wheel2
  = <node 1> , <vec3> , <node 2> , <offset> , <vec3> , <wheel radius [m]> , <tyre radius [m]> , <volume coefficient> , <pressure [Pa]> , <polytropic exponent> , <hysteresis velocity [m/s]> [ , slip , <drive> , <drive> , <drive> [ , threshold , <velocity [m/s]> , <side slip [rad]> ] ]
  > .usr: F [N] (3), M [N m] (3), effective radius, penetration, normal velocity, slip, side slip [deg], mu x, mu y, speed along the ground of the axle, of the contact
inline friction
  = node1 , <node 1> , [ offset , <offset> , ] [ { hinge | orientation } , <orientation> , ] node2 , <node 2> [ , offset , <offset> ] [ , coulomb friction coefficient , <mu> [ , static friction coefficient , <mu> ] [ , sliding velocity coefficient , <velocity [m/s]> ] [ , sliding velocity exponent , <exponent> ] , micro slip displacement , <displacement [m]> [ , initial stiction state , <fraction> ] [ , initial stiction derivative , <rate> ] ] [ , viscous friction coefficient , <viscosity [N s/m]> ] [ , stiction state equation scale , <scale> ]
  > .usr: lambda1 [N], lambda2 [N], z, dz/dt
asynchronous_machine
  = rotor , <node 1> , stator , <node 2> , MK , <breakdown torque [N m]> , sK , <breakdown slip> , OmegaS , <drive> [ , motor on , <drive> ] [ , M0 , <initial torque [N m]> ] [ , MP0 , <rate [N m/s]> ]
  > .usr: torque, its rate, speed
  ! yes: columns of `.usr`: torque, its rate, speed

@ jointregularization | joint regularization : <label of the joint> , <word> [ , <grammar> ] ;
tikhonov
  = [ <coefficient> | list , ( <coefficient> ) * 6 ]
dynamic
  = [ <coefficient> | list , ( <coefficient> ) * 6 ]
  ! yes: as `tikhonov`, to which it converges
jacobian
  = [ <coefficient> | list , ( <coefficient> ) * 6 ]
  ! yes: in the matrix only

@ hydraulic | hydraulic : <label> , <word> , <grammar> [ , output , <yes or no> ] ;
accumulator
  = <hydraulic node> , <stroke [m]> , [ start , <start position [m]> , ] <area [m2]> , <pipe area [m2]> , <mass [kg]> , [ loss in , <loss> , ] [ loss out , <loss> , ] [ gas , <pressure [Pa]> , <highest pressure [Pa]> , <kappa> , ] [ weight , <mass [kg]> , ] [ spring , <stiffness [N/m]> , <preload [N]> , ] <stop stiffness> , <stop damping> , <stop mass> , <element fluid>
  > .hyd: s, v, dv/dt, gas pressure, Q, 0
actuator
  = <hydraulic node> , <hydraulic node 2> , <node 1> , <offset> , <node 2> , <offset> , [ direction , <direction> , ] <area 1 [m2]> , <area 2 [m2]> , <length [m]> , <element fluid> , { same | <element fluid> }
  > .hyd: q1, q2 [kg/s], p1, p2 [Pa], their rates, V1, V2 [m3], rho1, rho2
control valve
  = <hydraulic node> , <hydraulic node 2> , <hydraulic node 3> , <hydraulic node 4> , <area [m2]> , [ loss , <fraction> , ] <drive> , <element fluid>
  > .hyd: state, Q1 ... Q4
control valve 2
  = <hydraulic node> , <hydraulic node 2> , <hydraulic node 3> , <hydraulic node 4> , <area [m2]> , [ loss , <fraction> , ] <drive> , <element fluid>
  > .hyd: state, Q1 ... Q4
dynamic control valve
  = <hydraulic node> , <hydraulic node 2> , <hydraulic node 3> , <hydraulic node 4> , <drive> , <s0 [m]> , <stroke [m]> , <width [m]> , [ loss , <fraction> , ] <diameter [m]> , <density [kg/m3]> , <stop stiffness> , <stop damping> , <stop mass> , <element fluid>
  > .hyd: s, ds/dt, dv/dt, Q1 ... Q4, A12, A13, A34, A24
pressure flow control
  = <hydraulic node> , <hydraulic node 2> , <hydraulic node 3> , <hydraulic node 4> , <hydraulic node 5> , <hydraulic node 6> , <drive> , <s0 [m]> , <stroke [m]> , <width [m]> , [ loss , <fraction> , ] <diameter [m]> , <density [kg/m3]> , <stop stiffness> , <stop damping> , <stop mass> , <element fluid>
  > .hyd: s, ds/dt, dv/dt, Q1 ... Q6, A12, A13, A34, A24
pressure flow control valve
  = <hydraulic node> , <hydraulic node 2> , <hydraulic node 3> , <hydraulic node 4> , <hydraulic node 5> , <hydraulic node 6> , <drive> , <s0 [m]> , <stroke [m]> , <width [m]> , [ loss , <fraction> , ] <diameter [m]> , <density [kg/m3]> , <stop stiffness> , <stop damping> , <stop mass> , <element fluid>
  > .hyd: s, ds/dt, dv/dt, Q1 ... Q6, A12, A13, A34, A24
dynamic pipe
  = <hydraulic node> , <hydraulic node 2> , <diameter [m]> , [ area , <area [m2]> , ] <length [m]> , [ turbulent , ] [ initial value , <flow [kg/s]> , ] <element fluid>
  > .hyd: P1, P2, their rates, q1, q2, their rates, rho1, rho0, rho2, b1, b2, Re, turbulent
pipe
  = <hydraulic node> , <hydraulic node 2> , <diameter [m]> , [ area , <area [m2]> , ] <length [m]> , [ turbulent , ] [ initial value , <flow [kg/s]> , ] <element fluid>
  > .hyd: v [m/s], q [kg/s], Re
flow valve
  = <hydraulic node> , <hydraulic node 2> , <hydraulic node 3> , <area [m2]> , <mass [kg]> , <pipe area [m2]> , <spool area [m2]> , <stiffness [N/m]> , <preload [N]> , <width [m]> , <stroke [m]> , <stop stiffness> , <stop damping> , <stop mass> , <element fluid>
  > .hyd: s, v, dv/dt, Q1, Q2, Q3
pressure valve
  = <hydraulic node> , <hydraulic node 2> , <area [m2]> , <mass [kg]> , <spool area [m2]> , <stroke [m]> , <stiffness [N/m]> , <preload [N]> , <width [m]> , <stop stiffness> , <stop damping> , <stop mass> , <element fluid>
  > .hyd: s, v, dv/dt, Q1, Q2
minor loss
  = <hydraulic node> , <hydraulic node 2> , <loss 1 to 2> , <loss 2 to 1> , <area [m2]> , <element fluid>
  > .hyd: v, q
three way minor loss
  = <hydraulic node> , <hydraulic node 2> , <hydraulic node 3> , <loss out> , <loss in> , <area 1 [m2]> , <area 2 [m2]> , <element fluid>
  > .hyd: v, q
orifice
  = <hydraulic node> , <hydraulic node 2> , <diameter [m]> , <small area [m2]> , [ area , <area [m2]> , ] [ reynolds , <critical Reynolds number> , ] <element fluid>
  > .hyd: v, q, Re, turbulent
tank
  = <hydraulic node> , <hydraulic node 2> , <pressure [Pa]> , <pipe area [m2]> , <area [m2]> , <stroke [m]> , [ start level , <level [m]> , ] [ alarm level , <level [m]> , ] <stop stiffness> , <element fluid>
  > .hyd: level, its rate, -q1, -q2
)";

}  // namespace mbcosim::grammar
