
// ---- a bus: its state, its nodes ---------------------------------------------------------------------------

const PHASES = ['CP0', 'CP1', 'CP2', 'CP3', 'CP4'];
// The load is that of so many seconds.
const LOAD_SECONDS = 5;

const busView = { name: null };

function buildBus(name, bus) {
  const view = byId('view-bus');
  const subtitle = head(view, name, choice('bus', last.status.buses.map((known) => known.name), name));
  const state = section(view, 'bus-state', 'State', true);
  const phases = bus.kind === 'sercos' ? state.appendChild(element('ol', 'phases')) : null;
  if (phases) {
    phases.setAttribute('aria-label', 'Communication phase');
    for (const phase of PHASES) phases.appendChild(element('li', '', phase));
  }
  const facts = state.appendChild(element('dl'));
  const nodes = section(view, 'bus-nodes', bus.kind === 'sercos' ? 'Topology' : 'Nodes', true);
  Object.assign(busView, {
    name,
    subtitle,
    phases,
    facts,
    line: bus.kind === 'sercos' ? nodes.appendChild(element('ol', 'line')) : null,
    key: '',
    table: table(nodes, NODE[bus.kind]),
    loads: [],
  });
}

const NODE = {
  sercos: ['Slave', 'Axis', 'Takes part', 'Link', 'Device status'],
  canopen: ['Node', 'Axis', 'Master', 'Network management', 'Last EMCY'],
  devicenet: ['Node', 'Axis', 'Connection', 'Identity status'],
};

function showBus({ status }, name) {
  const bus = status.buses.find((known) => known.name === name);
  if (!bus) return unknown(`There is no bus ${name}.`);
  if (busView.name !== name) buildBus(name, bus);
  setText(busView.subtitle, bus.interface);
  if (busView.phases) {
    [...busView.phases.children].forEach((item, phase) => {
      if (bus.phase === phase) item.setAttribute('aria-current', 'step');
      else item.removeAttribute('aria-current');
    });
  }
  list(busView.facts, busFacts(bus, status.uptime_s));
  const axes = status.axes.filter((axis) => axis.bus === name);
  if (busView.line) showTopology(bus, axes);
  rows(busView.table, axes, labels(NODE[bus.kind], 9), (axis) => nodeCells(bus.kind, axis));
  return undefined;
}

function busFacts(bus, uptime) {
  const pairs = [
    ['State', bus.up ? 'in cyclic operation' : 'not in cyclic operation', bus.up ? 'good' : 'bad'],
    ['Cycle', span(bus.cycle_ns)],
    ['Cycles', whole(bus.cycles)],
    ['Lost telegrams', whole(bus.lost_telegrams), lossTone(bus.lost_telegrams)],
    ['Refused frames', whole(bus.refused_frames), lossTone(bus.refused_frames)],
    ['System time', bus.phase_lock === 'free' ? 'not followed' : `${bus.phase_lock}, ${span(bus.phase_error_ns)} off`],
  ];
  if (bus.topology !== null) pairs.splice(1, 0, ['Topology', bus.topology]);
  bus.ports.forEach((port, index) => {
    const lost = `${whole(port.lost_mdt)} MDT, ${whole(port.lost_at)} AT`;
    pairs.push([`Lost on port ${index + 1}`, lost, lossTone(port.lost_mdt + port.lost_at)]);
  });
  if (bus.bit_rate !== null) pairs.splice(1, 0, ['Bit rate', `${bus.bit_rate / 1000} kbit/s`]);
  if (bus.busy_ns !== null) {
    const load = busLoad(uptime, bus.busy_ns);
    pairs.splice(2, 0, ['Load', load === null ? 'measured now' : `${load.toFixed(1)} %, with all stuff bits`,
      load > 70 ? 'warn' : '']);
  }
  return pairs;
}

// How much of the last seconds frames have occupied the bus, in percent.
function busLoad(uptime, busy) {
  const { loads } = busView;
  const newest = loads[loads.length - 1];
  if (newest && uptime < newest.uptime) loads.length = 0;
  if (!newest || uptime > newest.uptime) loads.push({ uptime, busy });
  while (loads.length > 2 && uptime - loads[1].uptime >= LOAD_SECONDS) loads.shift();
  const seconds = uptime - loads[0].uptime;
  return seconds > 0 ? (busy - loads[0].busy) / 1e9 / seconds * 100 : null;
}

const hex = (value, digits = 4) =>
  (value ? `0x${value.toString(16).toUpperCase().padStart(digits, '0')}` : '');

function nodeCells(kind, axis) {
  const { node } = axis;
  const link = { text: axis.name, href: `#/axis/${axis.name}`, more: axis.drive };
  if (!node) {
    const rest = NODE[kind].slice(3).map(() => ({ text: '' }));
    return [{ text: axis.address }, link, { text: 'not found', tone: 'bad' }, ...rest];
  }
  if (kind === 'sercos') {
    return [
      { text: axis.address, more: `place ${node.place}` },
      link,
      { text: node.state, tone: node.state === 'active' ? 'good' : 'bad' },
      { text: node.link || '' },
      node.status === null
        ? { text: 'no AT came', tone: 'bad' }
        : { text: hex(node.status) || '0x0000', more: node.conditions.join(', ') },
    ];
  }
  if (kind === 'canopen') {
    return [
      { text: axis.address },
      link,
      { text: node.state, tone: node.state === 'operational' ? 'good' : /lost|failed/.test(node.state) ? 'bad' : '' },
      { text: node.nmt || 'not reported' },
      { text: node.emcy || 'none', tone: node.emcy && !node.emcy.startsWith('0000') ? 'warn' : '' },
    ];
  }
  const status = node.status === null ? 'not read' : hex(node.status) || '0x0000';
  return [{ text: axis.address }, link, { text: node.state, tone: node.state === 'exchange' ? 'good' : '' }, { text: status }];
}

// The slaves in the order of the network, between the ports of the master.
function showTopology(bus, axes) {
  const slaves = new Map();
  for (const axis of axes) {
    const place = axis.node ? axis.node.place : 1000;
    const known = slaves.get(place) || { place, state: axis.node ? axis.node.state : 'not found', names: [], address: axis.address };
    known.names.push(axis.name);
    slaves.set(place, known);
  }
  const parts = [...slaves.values()].sort((one, other) => one.place - other.place);
  const key = JSON.stringify([bus.topology, parts]);
  if (busView.key === key) return;
  busView.key = key;
  const item = (title, text, tone) => {
    const node = element('li');
    const part = node.appendChild(element('div', tone));
    part.appendChild(element('p', '', title));
    part.appendChild(element('small', '', text));
    return node;
  };
  const nodes = parts.map((slave) => item(slave.names.join(', '), `${slave.address}, ${slave.state}`,
    slave.state === 'active' ? 'active' : 'lost'));
  if (bus.topology !== 'line on port 2') nodes.unshift(item('Gateway', 'port 1', ''));
  if (bus.topology === 'line on port 2' || /ring/.test(bus.topology || '')) nodes.push(item('Gateway', 'port 2', ''));
  busView.line.replaceChildren(...nodes);
}
