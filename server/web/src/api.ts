/** The service as the page calls it: Connect beside the page, which a proxy may serve under a prefix. */
import { fromBinary } from '@bufbuild/protobuf';
import { Code, ConnectError, createClient } from '@connectrpc/connect';
import { createConnectTransport } from '@connectrpc/connect-web';
import { DeckDiagnosticsSchema, ErrorInfoSchema, SolverFailureSchema, type Diagnostic, type SolverFailure } from './gen/mbcosim/v1/common_pb';
import { Events } from './gen/mbcosim/v1/events_pb';
import { Geometry } from './gen/mbcosim/v1/geometry_pb';
import { Simulations, type CreateSimulationInlineReply } from './gen/mbcosim/v1/simulations_pb';
import { Telemetry } from './gen/mbcosim/v1/telemetry_pb';
import { isLost, newRequestId, repeatable } from './requests';
import { chunks, type NamedFile } from './upload';

const { origin = '', pathname = '' } = globalThis.location ?? {};
const transport = createConnectTransport({ baseUrl: origin + pathname.replace(/[^/]*$/, ''), useBinaryFormat: true, interceptors: [repeatable] });

export const simulations = createClient(Simulations, transport);
export const telemetry = createClient(Telemetry, transport);
export const geometry = createClient(Geometry, transport);
export const events = createClient(Events, transport);

/** Loads a deck: the new simulation, and what its reader had to say of it. */
export function loadDeck(files: readonly NamedFile[], main: string): Promise<CreateSimulationInlineReply> {
  const options = { displayName: main, requestId: newRequestId() };
  return simulations.createSimulationInline({ header: { source: { case: 'bundleMainFile', value: main }, options }, files: chunks(files) });
}

/** What a failed call says, taken apart. */
export interface Failure {
  message: string;
  /** Name of the service's `Reason`: "WRONG_STEP"; empty: the failure is not the service's. */
  reason: string;
  metadata: Record<string, string>;
  diagnostics: Diagnostic[];
  solver?: SolverFailure;
  cancelled: boolean;
  /** Nothing is wrong but that the daemon could not be asked: over when it answers again. */
  passing?: boolean;
}

/** The detail of this type, whose bytes are those of `google.rpc.ErrorInfo` too. */
function errorInfo(error: ConnectError) {
  for (const detail of error.details)
    if ('type' in detail && detail.type === 'google.rpc.ErrorInfo') return fromBinary(ErrorInfoSchema, detail.value as Uint8Array);
  return undefined;
}

/** What to do about it, where there is something. */
export function remedy(failure: Failure): string {
  return failure.reason === 'UNAUTHENTICATED' ? 'Open the address that the daemon printed when it started; where that has no token, with yours behind it: ?token=YOURS.' : '';
}

export function failureOf(thrown: unknown): Failure {
  const error = ConnectError.from(thrown);
  const info = errorInfo(error), lost = isLost(thrown);
  return {
    message: (!lost && error.rawMessage) || 'the daemon does not answer',
    reason: info?.reason ?? (error.code === Code.Unauthenticated ? 'UNAUTHENTICATED' : ''),
    metadata: info?.metadata ?? {},
    diagnostics: error.findDetails(DeckDiagnosticsSchema)[0]?.diagnostics ?? [],
    solver: error.findDetails(SolverFailureSchema)[0],
    cancelled: error.code === Code.Canceled,
    passing: lost || error.code === Code.Unavailable,
  };
}
