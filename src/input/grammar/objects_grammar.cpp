#include "input/grammar/texts.h"

namespace mbcosim::grammar {

const char* const kObjects = R"(
@ drive | [ function , ] <word> [ , <grammar> ]
array
  = <n drives> , ( <drive> ) * n drives
bistop
  = [ initial status , { inactive | active } , ] <drive> , <drive>
closest next
  = <t0 [s]> , { <t1 [s]> | forever } , <increment>
const
  = <value>
cosine
  = <t0 [s]> , <angular frequency [rad/s]> , <amplitude> , { <n cycles> | half | one | forever } , <initial value>
cubic
  = <c0> , <c1> , <c2> , <c3>
direct
discrete filter
  = <n outputs> , ( <a> ) * n outputs , <b0> , <n inputs> , ( <b> ) * n inputs , <drive>
dof
  = <dof> , <drive>
double ramp
  = <ascending slope> , <t0 [s]> , <t1 [s]> , <descending slope> , <t2 [s]> , { <t3 [s]> | forever } , <initial value>
double step
  = <t0 [s]> , <t1 [s]> , <height> , <initial value>
drive
  = <drive> , <drive>
element
  = <joint> , joint , { { string | name } , "<private datum>" | index , <n datum> } , <drive>
exponential
  = <amplitude> , <time constant [s]> , <t0 [s]> , <initial value>
file
  = <file driver> [ , <n column> ] [ , amplitude , <amplitude> ]
fourier series
  = <t0 [s]> , <angular frequency [rad/s]> , <n harmonics> , <a0> , ( <a> , <b> ) * n harmonics , { <n cycles> | one | forever } , <initial value>
frequency sweep
  = <t0 [s]> , <drive> , <drive> , <initial value> , { <t1 [s]> | forever } , <final value>
linear
  = <c0> , <c1>
meter
  = <t0 [s]> , { <t1 [s]> | forever } [ , steps , <n steps> ]
max
  = <n drives> , ( <drive> ) * n drives
min
  = <n drives> , ( <drive> ) * n drives
mult
  = <drive> , <drive>
node
  = <node> , structural , { { string | name } , "<node datum>" | index , <n datum> } , <drive>
null
one
parabolic
  = <c0> , <c1> , <c2>
periodic
  = <t0 [s]> , <period [s]> , <drive>
piecewise linear
  = <n points> , ( <increasing> , <y> ) * n points
postponed
  = <drive caller>
ramp
  = <slope> , <t0 [s]> , { <t1 [s]> | forever } , <initial value>
random
  = <amplitude> , <mean> , <t0 [s]> , { <t1 [s]> | forever } [ , steps , <n steps> ] [ , seed , { time | <n seed> } ]
sample and hold
  = <drive> , <drive> [ , initial value , <initial value> ]
scalar function
  = { "<scalar function>" | "<function name>" , <scalar function> }
sine
  = <t0 [s]> , <angular frequency [rad/s]> , <amplitude> , { <n cycles> | half | one | forever } , <initial value>
step
  = <t0 [s]> , <height> , <initial value>
step5
  = <t0 [s]> , <initial value> , <t1 [s]> , <final value>
string
  = "<expression of Time>"
tanh
  = <t0 [s]> , <amplitude> , <slope> , <initial value>
time
timestep
unit

@ law | <word> [ , <grammar> ]
array
  = <n laws> , ( <law> ) * n laws
axial wrapper
  = <direction 3> , <law 1>
bistop
  = <bistop> , <law>
contact elastic
  = <stiffness> , <exponent>
  + prestress 1
cubic elastic generic
  = <strain> , <strain> , <strain>
  + prestress
cubic viscoelastic generic
  = <strain> , <strain> , <strain> , <matrix>
  + prestress
double linear elastic
  = <stiffness> , <upper strain> , <lower strain> , <second stiffness>
  + prestress
double linear viscoelastic
  = <stiffness> , <upper strain> , <lower strain> , <second stiffness> , <damping> [ , second damping , <damping> ]
  + prestress
drive caller wrapper
  = <drive> , <law>
invariant angular
  = <fraction> , <law>
inverse square elastic
  = <stiffness> , <length [m]>
  + prestress
isotropic hardening elastic
  = <stiffness> , <reference strain> [ , linear stiffness , <stiffness> ]
  + prestress
linear elastic
  = <stiffness>
  + prestress
linear elastic bistop
  = <stiffness> , <bistop>
  + prestress
linear elastic generic
  = <matrix>
  + prestress
linear elastic generic axial torsion coupling
  = <matrix> , <coupling>
  + prestress
linear elastic isotropic
  = <stiffness>
  + prestress
linear time variant viscoelastic generic
  = <matrix> , <drive> , { <matrix> | proportional , <factor> } , <drive>
  + prestress
linear viscoelastic
  = <stiffness> , { <damping> | proportional , <factor> }
  + prestress
linear viscoelastic bistop
  = <stiffness> , <damping> , <bistop>
  + prestress
linear viscoelastic generic
  = <matrix> , { <matrix> | proportional , <factor> }
  + prestress
linear viscoelastic generic axial torsion coupling
  = <matrix> , { <matrix> | proportional , <factor> } , <coupling>
  + prestress
linear viscoelastic isotropic
  = <stiffness> , { <damping> | proportional , <factor> }
  + prestress
linear viscous
  = <damping>
linear viscous generic
  = <matrix>
linear viscous isotropic
  = <damping>
log elastic
  = <stiffness>
  + prestress
nlp elastic
  = <matrix> , <functions>
  + prestress
nlp viscoelastic
  = <matrix> , <functions> , { <matrix> | proportional , <factor> } , <functions>
  + prestress
nlp viscous
  = <matrix> , <functions>
  + prestress
nlsf elastic
  = <matrix> , <functions>
  + prestress
nlsf viscoelastic
  = <matrix> , <functions> , { <matrix> | proportional , <factor> } , <functions>
  + prestress
nlsf viscous
  = <matrix> , <functions>
  + prestress
scalar function elastic
  = "<scalar function>"
scalar function elastic isotropic
  = "<scalar function>"
scalar function elastic orthotropic
  = <functions>
shock absorber
  = [ prestrain , <drive> , ] <pressure [Pa]> , <area [m2]> , <interaction> , <polytropic exponent> , [ epsilon max , <upper strain> , ] [ epsilon min , <lower strain> , ] [ penalty , <stiffness> , <damping> , ] { metering , <drive> , [ negative , <drive> , ] [ orifice , <drive> , [ negative , <drive> , ] ] | orifice , <drive> , [ negative , <drive> , ] } <area [m2]> , <density [kg/m3]> , <coefficient> [ , friction , <velocity [1/s]> , <fraction> ]
  > with a rod, .jnt: pressure, area, elastic force, viscous force
symbolic
  = <symbolic>
symbolic elastic
  = epsilon , <strain symbols> , expression , <strain expressions>
  + prestress
symbolic viscoelastic
  = epsilon , <strain symbols> , epsilon prime , <rate symbols> , expression , <rate expressions>
  + prestress
symbolic viscous
  = epsilon prime , <rate symbols> , expression , <rate expressions>
  + prestress
turbulent viscoelastic
  = <stiffness> , <parabolic damping> [ , <threshold> [ , <linear damping> ] ]
  + prestress

@ function | <word> , <grammar>
chebychev
  = <lower> , <upper> , [ do not extrapolate , ] <c0> , <c1> , end
const
  = <value>
cubic spline
  = [ do not extrapolate , ] 0. , <y> , 1. , <y> , 2. , <y> , end
div
  = "<scalar function>" , "<scalar function>"
exp
  = [ base , <base> , ] [ coefficient , <coefficient> , ] <multiplier>
linear
  = 0. , <y> , 1. , <y>
log
  = [ base , <base> , ] [ coefficient , <coefficient> , ] <multiplier>
mul
  = "<scalar function>" , "<scalar function>"
multilinear
  = [ do not extrapolate , ] 0. , <y> , 1. , <y> , end
pow
  = <exponent>
sub
  = "<scalar function>" , "<scalar function>"
sum
  = "<scalar function>" , "<scalar function>"

@ fluid | <word> , <grammar>
exponential
  = density , <density [kg/m3]> , { sound celerity , <celerity [m/s]> | <bulk modulus [Pa]> } , <reference pressure [Pa]> , viscosity , <viscosity [Pa s]> , [ temperature , <temperature [K]> , ] <saturation pressure [Pa]>
incompressible
  = density , <density [kg/m3]> , viscosity , <viscosity [Pa s]> [ , pressure , <reference pressure [Pa]> ] [ , temperature , <temperature [K]> ]
linear compressible
  = density , <density [kg/m3]> , { sound celerity , <celerity [m/s]> | <bulk modulus [Pa]> } , <reference pressure [Pa]> , viscosity , <viscosity [Pa s]> [ , temperature , <temperature [K]> ]
linear thermal compressible
  = density , <density [kg/m3]> , { sound celerity , <celerity [m/s]> | <bulk modulus [Pa]> } , <reference pressure [Pa]> , <alpha [1/K]> , <temperature [K]> , viscosity , <viscosity [Pa s]>
super
  = density , <density [kg/m3]> , { sound celerity , <celerity [m/s]> | <bulk modulus [Pa]> } , <reference pressure [Pa]> , viscosity , <viscosity [Pa s]> [ , temperature , <temperature [K]> ]
uncompressible
  = density , <density [kg/m3]> , viscosity , <viscosity [Pa s]> [ , pressure , <reference pressure [Pa]> ] [ , temperature , <temperature [K]> ]

@ file driver | file : <label> , <word> , <grammar> ;
fixed step
  = { count | 3 } , 2 , initial time , { from file | <t0 [s]> } , time step , { from file | <h [s]> } , [ interpolation , { linear | const } , ] [ { pad zeroes , <yes or no> | bailout , { none | upper | lower | any } } , ] "<samples>"
variable step
  = 1 , [ interpolation , { linear | const } , ] [ { pad zeroes , <yes or no> | bailout , { none | upper | lower | any } } , ] "<samples>"
stream
  = { name | stream drive name } , "<name>" , <address> , [ { signal | no signal | blocking | non blocking } , ] [ input every , <n steps> , ] [ receive first , <yes or no> , ] [ timeout , <time [s]> , ] [ echo , "<file>" [ , precision , <n digits> ] [ , shift , <time [s]> ] , ] <n columns> [ , initial values , ( <value> ) * n columns ] [ , modifier , copy cast , [ swap , <yes or no> , ] all , double [ , size , <n bytes> ] ]
socket stream
  = name , "<name>" , <address> , <n columns>
RTAI input
  = name , "<name>" , <address> , <n columns>
socket
  = <n columns> , [ initial values , ( <value> ) * n columns , ] { local , "<path>" | port , <n port> }
  ! yes: on a daemon without `--deck-sockets` a port of that name, to which a peer attaches
)";

const char* const kNotation = R"(
@ notation | <word> ::= <grammar>
vec3
  = { null | <a1> , <a2> , <a3> [ , scale , <scale> ] }
vec6
  = { null | ( <a> ) * 6 [ , scale , <scale> ] }
mat3
  = { null | { eye | diag , ( <a> ) * 3 | sym , ( <a> ) * 6 | skew , ( <a> ) * 3 | matr , ( <a> ) * 9 | ( <a> ) * 9 } [ , scale , <scale> ] }
mat6
  = { null | { eye | diag , ( <a> ) * 6 | sym , ( <a> ) * 21 | anba , ( <a> ) * 36 | matr , ( <a> ) * 36 | ( <a> ) * 36 } [ , scale , <scale> ] }
rotation
  = { eye | 1 , 1. , 0. , 0. , 2 , { guess | 0. , 1. , 0. } | { euler | euler123 | euler313 | euler321 } , [ degrees , ] <angle> , <angle> , <angle> | vector , <p1 [rad]> , <p2 [rad]> , <p3 [rad]> | matr , 1. , 0. , 0. , 0. , 1. , 0. , 0. , 0. , 1. [ , tolerance , <tolerance> ] }
position
  = [ reference , { global | <frame> } , ] <vec3>
offset
  = [ reference , { global | node | <frame> } , ] <vec3>
velocity
  = [ reference , { global | <frame> } , ] <vec3>
angular velocity
  = [ reference , { global | <frame> } , ] <vec3>
direction
  = [ reference , { global | node | <frame> } , ] 0. , 0. , 1.
absolute orientation
  = [ reference , { global | <frame> } , ] <rotation>
orientation
  = [ reference , { global | node | <frame> } , ] <rotation>
inertia
  = [ reference , { global | node | <frame> } , ] diag , <J [kg m2]> , <J [kg m2]> , <J [kg m2]>
orientation description
  = { euler123 | euler313 | euler321 | orientation vector | orientation matrix }
yes or no
  = { yes | no | true | false | 1 | 0 }
dof
  = { <abstract node> , abstract , { algebraic | differential } | <node> , structural , 1 , { algebraic | differential | order , 1 | order , 2 } | <node> , structural , 4 , differential | <electric node> , electric , algebraic | <thermal node> , thermal , algebraic | <hydraulic node> , hydraulic | <parameter node> , parameter }
equation
  = { <abstract node> , abstract | <node> , structural , 3 | <electric node> , electric | <hydraulic node> , hydraulic | <thermal node> , thermal }
scalar value
  = { node dof , <abstract dof 3> | drive , <drive> }
drive
  = { <value> | [ function , ] <word of the drive group> | reference , <drive caller> }
vec3 drive
  = { null | [ single , ] <vec3> , <drive> | component , ( { inactive | <drive> } ) * 3 | array , 2 , ( <vec3> , <drive> ) * 2 | reference , <template drive caller> }
vec6 drive
  = { null | [ single , ] <vec6> , <drive> | component , ( { inactive | <drive> } ) * 6 | array , 1 , <vec6> , <drive> }
mat3 drive
  = { null | [ single , ] <mat3> , <drive> | component , ( { inactive | <drive> } ) * 9 | component , sym , ( <drive> ) * 6 | component , diag , ( <drive> ) * 3 }
mat6 drive
  = { null | [ single , ] <mat6> , <drive> | component , diag , ( <drive> ) * 6 }
law 1
  = { <word of the law group> | <stiffness> | reference , <constitutive law> }
law 3
  = { <word of the law group> | reference , <constitutive law> }
law 6
  = { <word of the law group> | reference , <constitutive law> }
scalar function
  = <word of the function group>
fluid
  = <word of the fluid group>
element fluid
  = { hydraulic fluid | fluid } , { reference , <hydraulic fluid> | <fluid> }
bistop
  = [ initial status , { inactive | active | <yes or no> } , [ capture reference strain , <yes or no> , ] ] <drive> , <drive>
beam output
  = { position | orientation [ , orientation description , <orientation description> ] | configuration | force | moment | forces | linear strain | angular strain | strains | linear strain rate | angular strain rate | strain rates | all }
method
  = { crank nicolson | { ms | hope } , <drive> [ , <drive> ] | third order , { ad hoc | <drive> } | bdf [ , order , { 1 | 2 } ] | implicit euler }
linear solver
  = { umfpack | klu | naive | lapack | y12 | superlu | taucs | harwell | meschach } [ , { map | cc | column compressed | dir | direct access } ] [ , { colamd | minimum degree | rcmk | king | sloan | nested dissection | mmdata } ] [ , { mt | multi thread } , <n threads> ] [ , workspace size , <n size> ] [ , pivot factor , <factor> ] [ , drop tolerance , <tolerance> ] [ , block size , <n size> ] [ , scale , { no | max | sum } ]
friction law
  = { modlugre , <sigma 0> , <sigma 1> , <sigma 2> , <kappa> , "<friction function>" | discrete coulomb , "<friction function>" [ , sigma2 , <sigma 2> ] [ , velocity ratio , <fraction> ] }
hinge friction
  = friction , <radius [m]> , [ preload , <preload [N]> , ] <friction law> , { simple | simple plane hinge }
guide friction
  = friction , [ preload , <preload [N]> , ] <friction law> , simple
inverse dynamics clause
  = { torque , <yes or no> [ , prescribed motion , <yes or no> ] | prescribed motion , <yes or no> | right hand side , <yes or no> [ , ergonomy , <yes or no> ] | ergonomy , <yes or no> }
communicator
  = { grpc , port , "<port name>" | "<input>" , [ unlink , ] "<output>" [ , no clobber ] | socket , [ create , <yes or no> , ] { { path | local } , "<path>" | port , <n port> [ , host , "<host>" ] } [ , socket type , tcp ] [ , { signal | no signal } ] } [ , sleep time , <time [s]> ] [ , precision , { default | <n digits> } ] [ , coupling , { loose | staggered | tight | 2 } ] [ , send after predict , <yes or no> ]
address
  = [ create , <yes or no> , ] { { path | local } , "<path>" | port , <n port> [ , host , "<host>" ] } [ , socket type , tcp ]
  ! yes: and `socket type, udp` of outputs; `grpc` in its place makes a port of the daemon alone
stream
  = { name | stream name } , "<port name>" , <address> , [ { signal | no signal | blocking | non blocking | send first | no send first | abort if broken | do not abort if broken } , ] [ output every , <n steps> , ] [ echo , "<file>" [ , precision , <n digits> ] [ , shift , <time [s]> ] , ] { values , 2 , [ nodedof , ] <dof> , drive , <drive> | motion , [ output flags , { position | orientation matrix | orientation matrix transpose | velocity | angular velocity } , ] { all | <node> } } [ , modifier , copy cast , [ swap , <yes or no> , ] all , { int8_t | uint8_t | int16_t | uint16_t | int32_t | uint32_t | float | double } [ , size , <n bytes> ] ]
command line
  = -D <NAME=VALUE>
  ! yes: `mbcosim run`, `validate`, `describe`, …: the value takes the place of what the first declaration of that name says
)";

}  // namespace mbcosim::grammar
