#include "input/grammar/texts.h"

namespace mbcosim::grammar {

const char* const kJoints = R"(
@ joint | joint : <label> , <word> , <grammar> [ , inverse dynamics , <inverse dynamics clause> ] [ , output , <yes or no> ] ;
angular acceleration
  = <node> , <direction> , <drive>
  > .jnt: 0 (3), (M, 0, 0) [N m], 0 (3), M (3), dw/dt [rad/s2]
angular velocity
  = <node> , <direction> , <drive>
  > .jnt: 0 (3), (M, 0, 0) [N m], 0 (3), M (3), direction (3), w [rad/s]
axial rotation
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <drive> [ , orientation description , <orientation description> ] [ , <hinge friction> ]
  > .jnt: f (3), m (3), F (3), M (3), relative orientation [deg], speed, relative w (3) [, friction moment, coefficient]
beam slider
  = <node 4> , <offset> , [ hinge , <orientation> , ] [ type , { spherical | classic } , ] 1 , <beam3> , <offset> , [ hinge , <orientation> , ] <offset> , [ hinge , <orientation> , ] <offset> [ , hinge , <orientation> ] [ , initial beam , 1 ] [ , initial node , { 1 | 2 | 3 } ] [ , smearing , <fraction> ]
  > .jnt: F (3), M (3), F (3), M (3), beam, place along the beams, tangent (3)
brake
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <hinge friction> , <drive>
  > .jnt: f (3), m (3), F (3), M (3), relative orientation [deg], relative w (3), friction moment, coefficient, normal force
cardano hinge
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> [ , { hinge | orientation } , <orientation> ]
  > .jnt: f (3), (M, 0, 0), F (3), M (3), relative orientation [deg] (3)
universal hinge
  = <node 1> , <offset> , <node 2> , <offset>
  > .jnt: as `cardano hinge`
cardano pin
  = <node> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] [ position , ] <position> [ , { hinge | orientation } , <absolute orientation> ]
  > .jnt: f (3), (M, 0, 0), F (3), M (3), relative orientation [deg] (3)
universal pin
  = <node> , <offset> , <position>
  > .jnt: as `cardano pin`
cardano rotation
  = <node 1> , [ { hinge | orientation } , <orientation> , ] <node 2> [ , { hinge | orientation } , <orientation> ] [ , orientation description , <orientation description> ]
  > .jnt: 0 (3), (M, 0, 0), 0 (3), M (3), relative orientation
universal rotation
  = <node 1> , <node 2>
  > .jnt: as `cardano rotation`
clamp
  = <node> , [ position , ] { node | <position> } , [ orientation , ] { node | <absolute orientation> } [ , initial state , <vec3> , <vec3> ]
  > .jnt: f [N] (3), m [N m] (3) in the node's frame, F (3), M (3)
deformable axial joint
  = <node 1> , [ position , <offset> , ] [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , <offset> , ] [ { hinge | orientation } , <orientation> , ] <law 1>
  > .jnt: 0 (3), (0, 0, m), 0 (3), M (3), angle [rad] [, rate]
deformable displacement hinge
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <law 3>
  > .jnt: as `deformable displacement joint`
deformable displacement joint
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <law 3>
  > .jnt: f (3), 0 (3), F (3), 0 (3), d [m] (3) [, its rate (3)]
deformable hinge
  = <node 1> , [ position , <offset> , ] [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , <offset> , ] [ { hinge | orientation } , <orientation> , ] <law 3> [ , orientation description , <orientation description> ]
  > .jnt: 0 (3), m (3), 0 (3), M (3), relative orientation [, relative w (3)]
deformable joint
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <law 6> [ , orientation description , <orientation description> ]
  > .jnt: f (3), m (3), F (3), M (3), d [m] (3), relative orientation [, rates (6)]
distance
  = <node 1> [ , position , <offset> ] , <node 2> [ , position , <offset> ] , { from nodes | <distance drive> }
  > .jnt: (f, 0, 0) [N], 0 (3), F (3), 0 (3), direction (3), distance [m]
distance with offset
  = <node 1> , [ position , ] <offset> , <node 2> , [ position , ] <offset> , { from nodes | <distance drive> }
  > .jnt: as `distance`
drive displacement
  = <node 1> , [ position , ] <offset> , <node 2> , [ position , ] <offset> , <vec3 drive>
  > .jnt: f (3), 0 (3), F (3), 0 (3), distance of the points (3)
drive displacement pin
  = <node> , [ position , ] <offset> , [ position , ] <position> , <vec3 drive>
  > .jnt: F (3), 0 (3), F (3), 0 (3), distance of the points (3)
drive hinge
  = <node 1> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ { hinge | orientation } , <orientation> , ] <vec3 drive>
  > .jnt: 0 (3), m (3), 0 (3), M (3), relative orientation [deg] (3), relative rotation vector [rad] (3)
gimbal rotation
  = <node 1> , [ { hinge | orientation } , <orientation> , ] <node 2> [ , { hinge | orientation } , <orientation> ] [ , orientation description , <orientation description> ]
  > .jnt: 0 (3), m (3), 0 (3), M (3), theta, phi [rad], relative orientation
imposed displacement
  = <node 1> , [ position , ] <offset> , <node 2> , [ position , ] <offset> , <vec3 drive>
  > .jnt: as `total joint`
imposed displacement pin
  = <node> , [ position , ] <offset> , [ position , ] <position> , <vec3 drive>
  > .jnt: as `total pin joint`
imposed orientation
  = <node 1> , [ { hinge | orientation } , ] <orientation> , <node 2> , [ { hinge | orientation } , ] <orientation> , <vec3 drive>
  > .jnt: as `total joint`
in line
  = <node 1> , [ position , ] <offset> , [ orientation , ] <orientation> , <node 2> [ , offset , <offset> ] [ , <guide friction> ]
  > .jnt: (F1, F2, 0), 0 (3), F (3), 0 (3) [, friction force, coefficient]
in plane
  = <node 1> , [ position , ] <offset> , <direction> , <node 2> [ , offset , <offset> ]
  > .jnt: (F, 0, 0), 0 (3), F (3), 0 (3)
invariant deformable displacement joint
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <law 3>
  > .jnt: as `deformable displacement joint`
invariant deformable hinge
  = <node 1> , [ position , <offset> , ] [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , <offset> , ] [ { hinge | orientation } , <orientation> , ] <law 3> [ , orientation description , <orientation description> ]
  > .jnt: as `deformable hinge`
invariant deformable joint
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <law 6> [ , orientation description , <orientation description> ]
  > .jnt: as `deformable joint`
linear acceleration
  = <node> , <direction> , <drive>
  > .jnt: (F, 0, 0) [N], 0 (3), F (3), 0 (3), a [m/s2]
linear velocity
  = <node> , <direction> , <drive>
  > .jnt: (F, 0, 0) [N], 0 (3), F (3), 0 (3), direction (3), v [m/s]
modal
  = { <modal node> | clamped [ , position , <position> ] [ , orientation , <absolute orientation> ] } , 2 , [ list , 1 , 2 , ] [ initial value , mode , 1 , <q> , <rate> , ] { from file | 2 } , [ { no damping | rayleigh damping , <mass factor> , <stiffness factor> | single factor damping , <factor> | proportional damping , <factor> | diag damping , { all , <factor> , <factor> | 1 , 1 , <factor> } | damping from file } , ] "<FEM data>" , [ { threshold | mass threshold | damping threshold | stiffness threshold } , <threshold> , ] [ { create binary | use binary | update binary } , ] [ echo , "<file>" [ , precision , <n digits> ] , ] [ { origin node , "<FEM node>" | origin position , <vec3> } , ] 1 , "<FEM node>" , <node> , <offset> [ , { hinge | orientation } , <orientation> ] [ , output , <yes or no> ]
  > .mod: joint.mode: q, dq/dt, d2q/dt2; .jnt: reactions of interface nodes that ask for them
  ! yes: FEM data files in text and binary (version 4)
pin
  = <node> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] [ position , ] <position>
  > .jnt: F (3), 0 (3), F (3), 0 (3), orientation [deg] (3)
spherical pin
  = <node> , <offset> , <position>
  > .jnt: as `pin`
plane hinge
  = <node 1> , <offset> , <node 2> , <offset>
  > .jnt: as `revolute hinge`
plane pin
  = <node> , <offset> , <position>
  > .jnt: as `revolute pin`
point contact
  = <node 1> , <node 2> , <direction> , <stiffness [N/m]>
prismatic
  = <node 1> , [ { hinge | orientation } , <orientation> , ] <node 2> [ , { hinge | orientation } , <orientation> ]
  > .jnt: 0 (3), m (3), 0 (3), M (3)
revolute hinge
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> [ , { hinge | orientation } , <orientation> ] [ , orientation description , <orientation description> ] [ , initial theta , <angle [rad]> ] [ , <hinge friction> ]
  > .jnt: f (3), (M1, M2, 0), F (3), M (3), relative orientation [deg], relative w (3) [, friction moment, coefficient]
revolute pin
  = <node> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] [ position , ] <position> [ , { hinge | orientation } , <absolute orientation> ] [ , initial theta , <angle [rad]> ]
  > .jnt: f (3), (M1, M2, 0), F (3), M (3), relative orientation [deg] (3), relative w (3)
revolute rotation
  = <node 1> , [ position , <offset> , ] [ { hinge | orientation } , <orientation> , ] <node 2> [ , position , <offset> ] [ , { hinge | orientation } , <orientation> ] [ , orientation description , <orientation description> ]
  > .jnt: as `revolute hinge`, without forces
rod
  = <node 1> [ , position , <offset> ] , <node 2> [ , position , <offset> ] , { from nodes | <length [m]> } , <law 1>
  > .jnt: (f, 0, 0) [N], 0 (3), F (3), 0 (3), length [m], direction (3), rate of the length [, columns of the law]
rod bezier
  = <node 1> , [ position , ] <offset> , [ position , ] <direction> , <node 2> , [ position , ] <direction> , [ position , ] <offset> , { from nodes | <length [m]> } [ , integration order , <n order> ] [ , integration segments , <n segments> ] , <law 1>
  > .jnt: F, 0 (5), F l1 (3), 0 (3), F l2 (3), length [m], l1 (3), l2 (3), rate of the length [, columns of the law]
rod with offset
  = <node 1> , [ position , ] <offset> , <node 2> , [ position , ] <offset> , { from nodes | <length [m]> } , <law 1>
  > .jnt: as `rod`
screw
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , ] <orientation> , <node 2> , [ offset , <offset> , ] pitch , <pitch [m]> [ , friction , [ preload , <preload> , ] <friction law> , screw joint , radius , <radius [m]> , half thread angle , <angle [rad]> ]
  > .jnt: f (3), m (3), F (3), M (3), angle [rad], displacement [m] [, friction moment, coefficient]
spherical hinge
  = <node 1> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <node 2> , [ position , ] <offset> [ , { hinge | orientation } , <orientation> ] [ , orientation description , <orientation description> ]
  > .jnt: f (3), 0 (3), F (3), 0 (3), relative orientation
total equation
  = <node 1> [ , position , <offset> ] [ , position orientation , <orientation> ] [ , rotation orientation , <orientation> ] , <node 2> [ , position , <offset> ] [ , position orientation , <orientation> ] [ , rotation orientation , <orientation> ] [ , position constraint , active , inactive , inactive , <vec3 drive> ] [ , orientation constraint , active , active , active , <vec3 drive> ]
  > .jnt: 0 (12), relative position (3), relative rotation vector (3), their rates (6)
total internal reaction
  = <node 1> [ , position , <offset> ] [ , position orientation , <orientation> ] [ , rotation orientation , <orientation> ] , <node 2> [ , position , <offset> ] [ , position orientation , <orientation> ] [ , rotation orientation , <orientation> ] , position constraint , active , inactive , inactive , total equation , <total equation>
  > .jnt: as `total joint`
total joint
  = <node 1> [ , position , <offset> ] [ , position orientation , <orientation> ] [ , rotation orientation , <orientation> ] , <node 2> [ , position , <offset> ] [ , position orientation , <orientation> ] [ , rotation orientation , <orientation> ] [ , position constraint , ( { inactive | active | position | velocity | <yes or no> } ) * 3 , <vec3 drive> ] [ , orientation constraint , ( { inactive | active | rotation | angular velocity | <yes or no> } ) * 3 , <vec3 drive> ]
  > .jnt: f (3), m (3), F (3), M (3), relative position (3), relative rotation vector [rad] (3), their rates (6)
total pin joint
  = <node> [ , position , <offset> ] [ , position orientation , <orientation> ] [ , rotation orientation , <orientation> ] [ , position , <position> [ , position orientation , <absolute orientation> ] [ , rotation orientation , <absolute orientation> ] ] [ , position constraint , ( { inactive | active | position | velocity | <yes or no> } ) * 3 , <vec3 drive> ] [ , orientation constraint , ( { inactive | active | rotation | angular velocity | <yes or no> } ) * 3 , <vec3 drive> ]
  > .jnt: as `total joint`
viscous body
  = <node> , [ position , ] <offset> , [ { hinge | orientation } , <orientation> , ] <viscous law 6>
  > .jnt: f (3), m (3), F (3), M (3), v (3), w (3)
)";

}  // namespace mbcosim::grammar
