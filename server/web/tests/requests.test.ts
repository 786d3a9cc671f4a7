import { Code, ConnectError, type UnaryRequest, type UnaryResponse } from '@connectrpc/connect';
import { describe, expect, test } from 'vitest';
import { newRequestId, repeatable } from '../src/requests';

const lost = () => new ConnectError('Failed to fetch', Code.Unknown, undefined, undefined, new TypeError('Failed to fetch'));

/** What goes out for a request when the calls go so. */
async function sent(message: object, ...calls: (() => UnaryResponse)[]): Promise<{ ids: unknown[]; outcome: unknown }> {
  const ids: unknown[] = [], request = { stream: false, message, signal: new AbortController().signal } as unknown as UnaryRequest;
  const outcome = await repeatable(async (asked) => {
    ids.push((asked.message as { requestId?: string }).requestId);
    return (calls[ids.length - 1] ?? calls[calls.length - 1])();
  })(request).catch((thrown: unknown) => thrown);
  return { ids, outcome };
}

const done = () => 'done' as unknown as UnaryResponse;
const fails = (error: Error) => () => {
  throw error;
};

describe('a request that changes something', () => {
  test('gets an identifier of its own', async () => {
    const { ids } = await sent({ requestId: '' }, done), others = await sent({ requestId: '' }, done);
    expect(ids[0]).toMatch(/^[0-9a-f]{32}$/);
    expect(others.ids[0]).not.toBe(ids[0]);
    expect(newRequestId()).not.toBe(newRequestId());
  });

  test('is sent again as it was when its reply is lost', async () => {
    const { ids, outcome } = await sent({ requestId: '' }, fails(lost()), done);
    expect(ids.length).toBe(2);
    expect(ids[1]).toBe(ids[0]);
    expect(outcome).toBe('done');
    expect((await sent({ options: { requestId: 'a' } }, fails(lost()), done)).outcome).toBe('done');
  });

  test('is not sent again when it was refused, nor for ever', async () => {
    const refused = new ConnectError('no', Code.FailedPrecondition);
    expect(await sent({ requestId: '' }, fails(refused), done)).toEqual({ ids: [expect.any(String)], outcome: refused });
    expect((await sent({ requestId: '' }, fails(lost()))).ids.length).toBe(3);
  });
});

test('a request that only asks is sent once, without an identifier', async () => {
  const { ids, outcome } = await sent({}, fails(lost()), done);
  expect(ids).toEqual([undefined]);
  expect(outcome).toBeInstanceOf(ConnectError);
});
