function reply = mbcosim_call(door, method, request)
% REPLY = MBCOSIM_CALL(DOOR, METHOD, REQUEST) calls a method of a daemon over HTTP, in GNU Octave and in MATLAB.
%
%   DOOR      of mbcosim_door
%   METHOD    "Simulations/Step": service and method of proto/mbcosim/v1
%   REQUEST   struct with the fields of the method's request; 64-bit numbers as text, lists as cell arrays
%   REPLY     struct with the fields of its reply, in lower camel case; 64-bit numbers come as text
%
% A call that fails is an error with the service's message; its identifier is the code, mbcosim:not_found say, or mbcosim:connection.
  if isempty(fieldnames(request))
    body = '{}';
  else
    body = jsonencode(request);
  end
  address = [door.address, 'mbcosim.v1.', method];
  if exist('OCTAVE_VERSION', 'builtin')
    text = post(address, door.token, body);
  else
    options = weboptions('RequestMethod', 'post', 'MediaType', 'application/json', 'ContentType', 'text', 'Timeout', 600, ...
                         'HeaderFields', {'Authorization', ['Bearer ', door.token]});
    text = webwrite(address, body, options);
  end
  reply = jsondecode(text);
  if isfield(reply, 'code')
    error(['mbcosim:', reply.code], '%s', reply.message);
  end
end

function text = post(address, token, body)
% Octave's webwrite sends forms only: curl sends the JSON. Token and body go through files that only this user can read.
  [sent, removed] = private_file(body);
  head = sprintf('header = "Authorization: Bearer %s"\nheader = "Content-Type: application/json"\nurl = "%s"\n', token, address);
  if ~isempty(regexp(address, '^https?://(localhost|127\.[\d.]+|\[::1\])[:/]', 'once'))
    head = [head, sprintf('noproxy = "*"\n')];  % none of the environment can stand between this machine and itself
  end
  [config, removed_too] = private_file(head);
  [status, text] = system(['curl --silent --show-error --max-time 600 --config "', config, '" --data-binary "@', sent, '" 2>&1']);
  if status ~= 0
    error('mbcosim:connection', '%s', strtrim(text));
  end
end

function [file, removed] = private_file(text)
% A new file with TEXT, which goes with REMOVED.
  file = tempname();
  handle = fopen(file, 'w');
  removed = onCleanup(@() delete(file));
  if handle < 0 || system(['chmod 600 "', file, '"']) ~= 0
    error('mbcosim:file', 'cannot write %s', file);
  end
  fwrite(handle, text);
  fclose(handle);
end
