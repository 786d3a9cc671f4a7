/** Requests that change something are told apart, and asked again where their replies were lost. */
import { ConnectError, type Interceptor } from '@connectrpc/connect';

/** A request whose reply is lost is sent again so many times, after these pauses in milliseconds. */
const PAUSES = [200, 800];

/** A text that no other request has. (Pages of plain HTTP have no `crypto.randomUUID`.) */
export function newRequestId(): string {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, '0')).join('');
}

/** Where requests have their identifiers: themselves, or among the choices about a new simulation. */
interface Identified {
  requestId?: string;
  options?: { requestId?: string };
  header?: { options?: { requestId?: string } };
}

/** Did the request go out without a reply that could be read? */
export function isLost(thrown: unknown): boolean {
  return thrown instanceof TypeError || (thrown instanceof ConnectError && thrown.cause instanceof TypeError);
}

/** The service does nothing twice for requests of one identifier: those that have one may be sent again. */
export const repeatable: Interceptor = (next) => async (request) => {
  if (request.stream) return next(request);
  const message = request.message as Identified;
  if (message.requestId === '') message.requestId = newRequestId();
  const known = message.requestId || message.options?.requestId || message.header?.options?.requestId;
  for (const pause of known ? PAUSES : []) {
    try {
      return await next(request);
    } catch (thrown) {
      if (!isLost(thrown) || request.signal.aborted) throw thrown;
      await new Promise((resolve) => setTimeout(resolve, pause));
    }
  }
  return next(request);
};
