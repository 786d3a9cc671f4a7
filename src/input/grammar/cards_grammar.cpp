#include "input/grammar/texts.h"

namespace mbcosim::grammar {

const char* const kBlocks = R"(
@ block | begin : <word> ; … end : <word> ;
data
  = problem : { initial value | inverse dynamics } ;
initial value
inverse dynamics
control data
nodes
drivers
elements

@ data card | <word> : <grammar> ;
problem
  = { initial value | inverse dynamics }

@ statement | <word> [ : <grammar> ] ;
begin
  = <block>
end
  = <block>
set
  = <declaration or expression>
setenv
  = [ overwrite , <yes or no> , ] "<NAME=value>"
  ! yes: seen by `$NAME` in file names of the deck only
include
  = "<file>"
remark
  = <expression> [ , <expression 2> ]
print symbol table
  = [ all | <namespace> ]
exit
chdir
  = "<folder>"
  ! no: a deck changes no folder
module load
  = "<module>" [ , <module arguments> ]
  ! partly: `wheel2`, `inline_friction`, `asynchronous_machine`, `minmaxdrive`: their words are built in; a deck loads no code
c81 data
  = <label> , [ name , "<name>" , ] "<file>" [ , tolerance , <tolerance> ] [ , { fc511 | nrel | free format } ] [ , flip ] [ , echo , "<file>" [ , free format ] ]
  ! ignored: checked for its form; only aerodynamic elements would use it
license
warranty
for
  = integer <variable> = <first> , <last> [ , <step> ]
end for
if
  = <expression>
else if
  = <expression>
else
end if
reference
  = <label> , [ name , "<name>" , ] { [ position , ] <position> , [ orientation , ] <absolute orientation> [ , [ velocity , ] <velocity> [ , [ angular velocity , ] <angular velocity> ] ] | denavit hartenberg , [ reference , global , ] <d [m]> , <theta [rad]> , <a [m]> , <alpha [rad]> }
drive caller
  = <label> , [ name , "<name>" , ] [ deferred , ] <drive> [ , output , { <yes or no> | value , <yes or no> | derivative , <yes or no> } ] [ , output trace , { <yes or no> | value , <yes or no> [ , derivative , <yes or no> ] } ]
  > .drv: value, derivative; .trc: value, derivative at every step
template drive caller
  = <label> , [ name , "<name>" , ] { 1 , <drive> | 3 , <vec3 drive> | 6 , <vec6 drive> | 3x3 , <mat3 drive> | 6x6 , <mat6 drive> }
constitutive law
  = <label> , [ name , "<name>" , ] { 1 , <law 1> | 3 , <law 3> | 6 , <law 6> }
scalar function
  = "<function name>" , <scalar function>
hydraulic fluid
  = <label> , [ name , "<name>" , ] <fluid>

@ initial value card | <word> [ : <grammar> ] ;
initial time
  = <t [s]>
final time
  = { <t [s]> | forever }
time step
  = <h [s]>
min time step
  = <h [s]>
max time step
  = { unlimited | <drive> } [ , hard limit , <yes or no> ]
  ! yes: `hard limit` is checked and has no effect
strategy
  = { no change | factor , <reduction> , <n steps before reduction> , <raise> , <n steps before raise> , <n min iterations> [ , <n max iterations> ] | change , <drive> }
tolerance
  = { <residual tolerance> | null , <solution tolerance> } [ , test , { norm | minmax } [ , scale ] ] [ , <solution tolerance> [ , test , { norm | minmax | none } ] ]
max iterations
  = <n iterations> [ , at most ]
modify residual test
max residual
  = { differential equations , <limit> | all equations , <limit> | <limit> }
enforce constraint equations
  = { constraint violations [ , scale factor , <factor> ] | constraint violation rates }
derivatives tolerance
  = <tolerance>
derivatives max iterations
  = <n iterations>
derivatives coefficient
  = { <coefficient> [ , auto ] | auto [ , max iterations , <n iterations> ] [ , factor , <factor> ] }
dummy steps number
  = <n steps>
dummy steps ratio
  = <ratio>
dummy steps tolerance
  = <tolerance>
dummy steps max iterations
  = <n iterations>
dummy steps method
  = <method>
fictitious steps number
  = <n steps>
fictitious steps ratio
  = <ratio>
fictitious steps tolerance
  = <tolerance>
fictitious steps max iterations
  = <n iterations>
fictitious steps method
  = <method>
method
  = <method>
nonlinear solver
  = { default | newton raphson [ , { true | modified , <n iterations> [ , keep jacobian matrix ] [ , honor element requests ] } ] | line search [ , modified , <n iterations> [ , keep jacobian matrix ] ] [ , tolerance x , <tolerance> ] [ , tolerance min , <tolerance> ] [ , max iterations , <n iterations> ] [ , alpha , <alpha> ] [ , lambda min , <lambda> [ , relative , <yes or no> ] ] [ , lambda factor min , <fraction> ] [ , max step , <step> ] [ , zero gradient , continue , <yes or no> ] [ , divergence check , <yes or no> [ , factor , <factor> ] ] [ , algorithm , { cubic | factor } ] [ , scale newton step , <yes or no> [ , min scale , <fraction> ] ] [ , print convergence info , <yes or no> ] [ , verbose , <yes or no> ] [ , abort at lambda min , <yes or no> ] [ , non negative slope continue , <yes or no> ] | matrix free , { default | bicgstab | gmres } [ , tolerance , <tolerance> ] [ , steps , <n steps> ] [ , tau , <tau> ] [ , eta , <eta> ] [ , preconditioner , full jacobian matrix [ , steps , <n steps> ] [ , honor element requests ] ] }
  ! partly: `newton raphson` and `line search`, whose `non negative slope continue` is checked and has no effect; `matrix free` is checked and solved by Newton-Raphson
newton raphson
  = { true | modified [ , <n iterations> ] }
linear solver
  = <linear solver>
  ! ignored: checked
solver
  = <linear solver>
  ! ignored: checked
output
  = { none | iterations | residual | solution | jacobian | jacobian matrix | bailout | messages | counter | cpu time | matrix condition number [ , norm , { inf | 1 } ] | solver condition number [ , stat , <yes or no> ] }
  ! partly: `none` and `messages`: whether `.out` has a line for each step; nothing is printed during the iterations
output meter
  = <drive>
  ! ignored: of this block
abort after
  = { input | assembly | derivatives | dummy steps }
eigenanalysis
  = { <t [s]> | list , <n times> , ( <increasing [s]> ) * n times } [ , parameter , <parameter> ] [ , { output matrices | output full matrices | output sparse matrices } ] [ , output eigenvectors ] [ , output geometry ] [ , matrix output precision , <n digits> ] [ , results output precision , <n digits> ] [ , upper frequency limit , <limit [Hz]> ] [ , lower frequency limit , <lower limit [Hz]> ] [ , suffix width , { compute | <n digits> } ] [ , suffix format , "<format>" ] [ , { use lapack | use arpack , <n eigenvalues> , <n vectors> , <tolerance> | use jdqz , <n eigenvalues> , <n vectors> , <tolerance> } ] [ , balance , { no | permute | scale | all } ]
  > .m: eigenvalues, modes, matrices
  ! yes: `use arpack` and `use jdqz`: an Arnoldi process with shift and inversion, without left eigenvectors
threads
  = { auto | disable | [ { assembly | solver } , ] <n threads> }
  ! ignored: large models take all cores; see `mbcosim run --threads`
real time
  = <arguments>
  ! ignored: use `mbcosim run --real-time`
interface linear solver
  = <linear solver>
  ! ignored
interface solver
  = <linear solver>
  ! ignored
pod
  = <arguments>
  ! ignored

@ inverse dynamics card | <word> [ : <grammar> ] ;
problem type
  = { fully actuated collocated | underdetermined fully actuated [ , weights , ( <weight of the change> , <weight of the inertia> ) * 3 ] }
  ! partly: `fully actuated collocated`, `underdetermined fully actuated`; the others are not implemented in MBDyn either
full residual test
  = [ <yes or no> ]
  ! yes: with a warning: such a test cannot hold
strategy
  = no change
  ! partly: `no change`: records are one time step apart
initial time
  = <t [s]>
final time
  = <t [s]>
time step
  = <h [s]>
min time step
  = <h [s]>
  ! ignored: records are one time step apart
max time step
  = { unlimited | <drive> } [ , hard limit , <yes or no> ]
  ! ignored: records are one time step apart
tolerance
  = { <residual tolerance> | null , <solution tolerance> } [ , test , { norm | minmax } [ , scale ] ] [ , <solution tolerance> [ , test , { norm | minmax | none } ] ]
max iterations
  = <n iterations> [ , at most ]
modify residual test
nonlinear solver
  = newton raphson [ , { true | modified , <n iterations> } ]
newton raphson
  = { true | modified [ , <n iterations> ] }
linear solver
  = <linear solver>
  ! ignored
solver
  = <linear solver>
  ! ignored
threads
  = { auto | disable | <n threads> }
  ! ignored
output
  = { none | iterations | residual | solution | jacobian | jacobian matrix | bailout | messages }
  ! partly: `none` and `messages`: whether `.out` has a line for each record; nothing is printed during the iterations
output meter
  = <drive>
  ! ignored
abort after
  = { input | assembly | derivatives }
real time
  = <arguments>
  ! ignored
)";

const char* const kControl = R"(
@ control card | <word> [ : <grammar> ] ;
skip initial joint assembly
use
  = { rigid bodies | gravity | forces | beams | plates | aerodynamic elements | loadable elements } , in assembly
  ! partly: `beams`, which take part anyhow, `forces` and `loadable elements`; the others have no effect (with a warning)
initial stiffness
  = <position stiffness> [ , <velocity stiffness> ]
stiffness
  = <position stiffness> [ , <velocity stiffness> ]
omega rotates
  = { yes | no }
tolerance
  = <tolerance>
initial tolerance
  = <tolerance>
max iterations
  = <n iterations>
max initial iterations
  = <n iterations>
epsilon
  = <epsilon>
linear solver
  = <linear solver>
  ! ignored: checked
solver
  = <linear solver>
  ! ignored: checked
default output
  = { all | none | reference frames | accelerations | drive callers | structural nodes | joints | beams | rigid bodies | forces | gravity | abstract nodes | electric nodes | hydraulic nodes | thermal nodes | genels | electric elements | hydraulic elements | thermal elements | loadable elements | plates | aerodynamic elements | induced velocity elements | aeromodals | air properties }
output frequency
  = <n steps>
output meter
  = <drive>
output precision
  = <n digits>
default orientation
  = <orientation description>
default beam output
  = <beam output>
  ! yes: for NetCDF; `.act` keeps its columns
default aerodynamic output
  = { position | orientation | velocity | all }
  ! ignored
output results
  = { netcdf [ , { classic | netcdf4 } ] [ , { sync | no sync } ] [ , { text | no text } ] | text }
  > .nc beside the text files
  ! partly: `no text` is ignored with a warning: the text files are written beside the `.nc`, but with `mbcosim run --format netcdf`; with `sync` each record can be read as soon as it is written
title
  = "<title>"
print
  = { dof stats | dof description | equation description | description | element connection | node connection | connection | all | none } [ , to file ]
  > .dof with `to file`, else standard output of `mbcosim run`
make restart file
  = [ { iterations , <n iterations> | time , <t [s]> | times , <n times> , ( <increasing [s]> ) * n times } [ , with solution array ] ]
  ! ignored: use snapshots
select timeout
  = { forever | <n minutes> }
  ! ignored: each port has its own time-out
default scale
  = { all | structural nodes | abstract nodes | electric nodes | thermal nodes | hydraulic nodes | joints | genels | electric elements | thermal elements | hydraulic elements | loadable elements } , <scale>
model
  = static
rigid body kinematics
  = { const [ , position , <position> ] [ , orientation , <absolute orientation> ] [ , velocity , <velocity> ] [ , angular velocity , <angular velocity> ] [ , acceleration , <vec3> ] [ , angular acceleration , <vec3> ] | drive [ , position , <vec3 drive> ] [ , orientation , <vec3 drive> ] [ , velocity , <vec3 drive> ] [ , angular velocity , <vec3 drive> ] [ , acceleration , <vec3 drive> ] [ , angular acceleration , <vec3 drive> ] }
  ! partly: inertia forces of bodies; modal joints are refused with it
loadable path
  = [ { set | add } , ] "<folder>"
  ! ignored
finite difference jacobian meter
  = <drive>
  ! ignored
use automatic differentiation
  ! ignored: a newer word; derivatives are exact without it
output units
  = <word>
  ! ignored: a newer word; units are those of the deck
units
  = length , "<unit of length>" , { mass , "<unit of mass>" | force , "<unit of force>" } , time , "<unit of time>"
  ! yes: a card of ours: descriptions name these units and ports convert them; no result changes
read solution array
  ! no: use snapshots
output file name
  = "<file>"
  ! no: `mbcosim run -o PREFIX`
gravity
air properties
  ! not yet: the count alone; aerodynamics
automatic structural elements
  = <n elements>
  ! ignored
driven elements
  ! no: `driven` elements are not counted; MBDyn refuses the word, too
electric bulk elements
  ! no: MBDyn refuses the word, too
structural nodes
  = <n nodes>
abstract nodes
  = <n nodes>
electric nodes
  = <n nodes>
hydraulic nodes
  = <n nodes>
thermal nodes
  = <n nodes>
parameter nodes
  = <n nodes>
file drivers
  = <n drivers>
rigid bodies
  = <n elements>
joints
  = <n elements>
joint regularizations
  = <n elements>
beams
  = <n elements>
plates
  = <n elements>
forces
  = <n elements>
genels
  = <n elements>
hydraulic elements
  = <n elements>
electric elements
  = <n elements>
thermal elements
  = <n elements>
bulk elements
  = <n elements>
aerodynamic elements
  = <n elements>
induced velocity elements
  = <n elements>
aeromodals
  = <n elements>
loadable elements
  = <n elements>
output elements
  = <n elements>
inertia
  = <n elements>
)";

}  // namespace mbcosim::grammar
