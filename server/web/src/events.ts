/** Events of the service in words. */
import { DeletionCause, PeerChange, SnapshotChange, type Event } from './gen/mbcosim/v1/events_pb';
import { SimulationState } from './gen/mbcosim/v1/simulations_pb';

export interface Told {
  text: string;
  level: 'info' | 'error';
}

const STATES: Record<number, string> = {
  [SimulationState.READY]: 'can be advanced again',
  [SimulationState.FINISHED]: 'has reached its final time',
  [SimulationState.FAILED]: 'has failed',
};
const PEERS: Record<number, string> = {
  [PeerChange.ATTACHED]: 'attached to',
  [PeerChange.LEFT]: 'left',
  [PeerChange.LATE]: 'is late at',
};
const SNAPSHOTS: Record<number, string> = {
  [SnapshotChange.SAVED]: 'saved the state at step',
  [SnapshotChange.RESTORED]: 'went back to step',
  [SnapshotChange.DELETED]: 'deleted the saved state of step',
};
const CAUSES: Record<number, string> = {
  [DeletionCause.ASKED]: 'was deleted',
  [DeletionCause.LEASE_OVER]: 'was deleted: nobody used it for its lease',
};

/** What an event says to people; nothing where there is nothing to say, or its kind is newer than this page. */
export function tell(event: Event): Told | undefined {
  const { content, identity } = event, who = identity || 'the service';
  const info = (text: string | undefined): Told | undefined => (text ? { text, level: 'info' } : undefined);
  switch (content.case) {
    case 'missed':
      return info(content.value.count !== undefined ? `${content.value.count} events were missed` : 'events were missed: the daemon was started anew');
    case 'created':
      return info(`${who} made the simulation${content.value.forkedFrom ? ` out of ${content.value.forkedFrom}` : ''}`);
    case 'deleted':
      return { text: `the simulation ${CAUSES[content.value.cause] ?? 'is gone'}`, level: 'error' };
    case 'stateChanged':
      return info(STATES[content.value.state] && `the simulation ${STATES[content.value.state]}, at step ${content.value.step}`);
    case 'stepFailed':
      return { text: `a step failed: ${content.value.failure?.message || 'no reason is given'}`, level: 'error' };
    case 'peer':
      return info(PEERS[content.value.change] && `${content.value.peer || 'the peer'} ${PEERS[content.value.change]} port ${content.value.port}`);
    case 'snapshot':
      return info(SNAPSHOTS[content.value.change] && `${who} ${SNAPSHOTS[content.value.change]} ${content.value.step}`);
    case 'leaseEnding':
      return { text: `the simulation is deleted in ${Math.round(content.value.secondsLeft)} s unless somebody uses it`, level: 'error' };
    default:
      return undefined;
  }
}
