// What the client needs from the other side: a server over the Foxglove protocol, or a recording. Everything above the client
// (the twin, the picture, the panels) is the same for both.
import type FoxgloveClient from '@foxglove/ws-protocol/dist/esm/src/FoxgloveClient';

export type Source = Pick<FoxgloveClient, 'on' | 'close' | 'subscribe' | 'unsubscribe' | 'advertise' | 'sendMessage' | 'sendServiceCallRequest'
  | 'fetchAsset' | 'getParameters' | 'setParameters' | 'subscribeParameterUpdates' | 'unsubscribeParameterUpdates'>;
