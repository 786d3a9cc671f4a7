% A pendulum, stepped from GNU Octave or MATLAB over HTTP. Start the daemon with
%
%   mbcosim view client_examples/models/pendulum.mbd
%
% and hand over the address that it prints:  octave-cli pendulum.m ADDRESS, in MATLAB by page = 'ADDRESS'; pendulum
if ~exist('page', 'var')
  arguments = argv();
  page = arguments{end};
end
door = mbcosim_door(page);

description = mbcosim_call(door, 'Simulations/DescribeSimulation', struct('simulation', door.simulation, 'variable_prefix', 'node.structural.2.'));
model = description.model;
names = {model.variables.name};
handle = @(name) model.variables(strcmp(names, name)).handle;

% A steady push sideways [N], from the first step on.
push = struct('handles', {{handle('node.structural.2.load')}}, 'values', [0, 5, 0, 0, 0, 0]);
mbcosim_call(door, 'Simulations/WriteVariables', struct('simulation', door.simulation, 'values', push));

request = struct('simulation', door.simulation, 'steps', '20', 'outputs', {{handle('node.structural.2.X')}});
for k = 1:5
  reply = mbcosim_call(door, 'Simulations/Step', request);
  fprintf('%.1f s  %9.6f %9.6f %9.6f\n', reply.time, reply.outputs);
end
