function door = mbcosim_door(page)
% DOOR = MBCOSIM_DOOR(PAGE) takes an address apart that `mbcosim view` or `mbcosimd --http` has printed.
%
%   door.address      "http://127.0.0.1:8765/"
%   door.token        what every call needs
%   door.simulation   name of the simulation; empty: the address has none
  parts = regexp(page, '^(?<address>https?://[^/]+/)(\?token=(?<token>[^#]*))?(#simulation=(?<simulation>.*))?$', 'names');
  if isempty(parts) || isempty(parts.address)
    error('mbcosim:address', '"%s" is no address of a page', page);
  end
  door = struct('address', parts.address, 'token', parts.token, 'simulation', parts.simulation);
end
