import { create } from '@bufbuild/protobuf';
import { describe, expect, test } from 'vitest';
import { tell } from '../src/events';
import { EventSchema, PeerChange, SnapshotChange } from '../src/gen/mbcosim/v1/events_pb';
import { SimulationState } from '../src/gen/mbcosim/v1/simulations_pb';
import { moment } from '../src/panels/log';

describe('an event', () => {
  test.each([
    ['who saved a state', { identity: 'token:ann', content: { case: 'snapshot' as const, value: { change: SnapshotChange.SAVED, step: 12n } } }, 'token:ann saved the state at step 12', 'info'],
    ['that a peer is late', { content: { case: 'peer' as const, value: { change: PeerChange.LATE, port: 'air', peer: 'cfd' } } }, 'cfd is late at port air', 'info'],
    ['that the end is reached', { content: { case: 'stateChanged' as const, value: { state: SimulationState.FINISHED, step: 7n } } }, 'the simulation has reached its final time, at step 7', 'info'],
    ['why a step failed', { content: { case: 'stepFailed' as const, value: { failure: { message: 'no convergence' } } } }, 'a step failed: no convergence', 'error'],
    ['that the lease ends', { content: { case: 'leaseEnding' as const, value: { secondsLeft: 29.6 } } }, 'the simulation is deleted in 30 s unless somebody uses it', 'error'],
  ])('tells %s', (_, init, text, level) => expect(tell(create(EventSchema, init))).toEqual({ text, level }));

  test('of another day has its date', () => {
    const wall = new Date(2024, 4, 6, 7, 8, 9);
    expect(moment(wall, new Date(2024, 4, 6, 23))).toBe(wall.toLocaleTimeString());
    expect(moment(wall, new Date(2024, 4, 7, 1))).toBe(wall.toLocaleString());
  });

  test('of a kind that is not known, or that says nothing, is passed over', () => {
    expect(tell(create(EventSchema, {}))).toBeUndefined();
    expect(tell(create(EventSchema, { content: { case: 'stateChanged', value: { state: SimulationState.STEPPING } } }))).toBeUndefined();
  });
});
