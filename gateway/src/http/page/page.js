// Shows each event of /events. Values are written as text only, and only where they have changed.
'use strict';

// An event comes twice a second. Without one for this long, the values are not live.
const STALE_AFTER_MS = 3000;
const RECONNECT_MS = 5000;

const byId = (id) => document.getElementById(id);

function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

function setClass(node, name) {
  if (node.className !== name) node.className = name;
}

function element(name, className, text) {
  const node = document.createElement(name);
  if (className) node.className = className;
  if (text !== undefined) node.textContent = text;
  return node;
}

const whole = (value) => Number(value).toLocaleString('en').replaceAll(',', '\u202f');
const number = (value, digits, unit) => `${value.toFixed(digits)} ${unit}`;

function duration(seconds) {
  const all = Math.floor(seconds);
  const [days, hours, minutes] = [Math.floor(all / 86400), Math.floor(all / 3600) % 24, Math.floor(all / 60) % 60];
  if (days) return `${days} d ${hours} h`;
  if (hours) return `${hours} h ${minutes} min`;
  if (minutes) return `${minutes} min ${all % 60} s`;
  return `${all} s`;
}

function span(nanoseconds) {
  const size = Math.abs(nanoseconds);
  if (size >= 1e6) return `${Number((nanoseconds / 1e6).toFixed(3))} ms`;
  if (size >= 1e3) return `${Number((nanoseconds / 1e3).toFixed(3))} µs`;
  return `${nanoseconds} ns`;
}

// The element of the value of a cell: a link where the cell has an address.
function valueOf(cell, href) {
  let value = cell.firstElementChild;
  if (!href) return value;
  if (value.tagName !== 'A') {
    value.replaceWith(element('a', 'value'));
    value = cell.firstElementChild;
  }
  if (value.getAttribute('href') !== href) value.setAttribute('href', href);
  return value;
}

// Keeps one row for each name, so that focus, selection and scroll position survive an event.
function rows(body, items, labels, fill) {
  while (body.children.length > items.length) body.lastElementChild.remove();
  items.forEach((item, index) => {
    let row = body.children[index];
    if (!row) {
      row = body.appendChild(element('tr'));
      labels.forEach((label, column) => {
        const cell = row.appendChild(element(column === 0 ? 'th' : 'td'));
        if (column === 0) cell.scope = 'row';
        else cell.dataset.label = label.name;
        const value = cell.appendChild(element('span'));
        value.className = 'value';
        cell.appendChild(element('span', 'more'));
        if (label.number) cell.classList.add('number');
      });
    }
    fill(item).forEach((cell, column) => {
      const [value, more] = [valueOf(row.children[column], cell.href), row.children[column].lastElementChild];
      setText(value, cell.text);
      setClass(value, cell.tone || 'value');
      setText(more, cell.more || '');
      more.hidden = !cell.more;
    });
  });
}

function list(target, pairs) {
  pairs.forEach(([name, text, tone], index) => {
    let term = target.children[2 * index];
    if (!term) {
      term = target.appendChild(element('dt'));
      target.appendChild(element('dd'));
    }
    setText(term, name);
    const value = term.nextElementSibling;
    setText(value, text);
    setClass(value, tone || '');
  });
  while (target.children.length > 2 * pairs.length) target.lastElementChild.remove();
}

const lampTone = (lamp) => (lamp.includes('red') ? 'bad' : lamp === 'solid green' ? 'good' : '');
const stateTone = (state) =>
  /fault/i.test(state) || state === 'Aborting' ? 'bad' : /^(operating|running)$/i.test(state) ? 'good' : '';
const lossTone = (count) => (count > 0 ? 'warn' : '');

const DEVICE = ['Device', 'Controller', 'Network status', 'Module status', 'Lost updates'];
const BUS = ['Bus', 'State', 'Cycle', 'Cycles', 'Lost telegrams', 'Refused frames'];
const AXIS = ['Axis', 'Controller sees', 'State', 'Drive reports', 'Owner', 'Position', 'Velocity', 'Torque',
  'Following error'];
const labels = (names, numbersFrom) => names.map((name, column) => ({ name, number: column >= numbersFrom }));

function showDevices(devices) {
  rows(byId('devices'), devices, labels(DEVICE, 4), (device) => [
    { text: device.name, more: device.address },
    device.controller
      ? { text: device.controller, more: `update period ${device.update_period_us / 1000} ms` }
      : { text: 'none' },
    { text: device.network_status, tone: lampTone(device.network_status) },
    { text: device.module_status, tone: lampTone(device.module_status) },
    { text: whole(device.lost_updates), tone: lossTone(device.lost_updates) },
  ]);
}

function showBuses(buses) {
  rows(byId('buses'), buses, labels(BUS, 2), (bus) => {
    const phase = bus.phase === null ? '' : ` (CP${bus.phase})`;
    return [
      { text: bus.name, more: bus.interface, href: `#/bus/${encodeURIComponent(bus.name)}` },
      bus.up ? { text: `up${phase}`, tone: 'good' } : { text: `not in cyclic operation${phase}`, tone: 'bad' },
      { text: span(bus.cycle_ns) },
      { text: whole(bus.cycles) },
      { text: whole(bus.lost_telegrams), tone: lossTone(bus.lost_telegrams) },
      { text: whole(bus.refused_frames), tone: lossTone(bus.refused_frames) },
    ];
  });
}

// Whether nothing is heard from the drive: what it has reported before is not live.
const isOld = (axis) => axis.inhibits.includes('no_drive');

function axisCells(axis) {
  const drive = [axis.bus, axis.drive].filter(Boolean).join(', ');
  const old = isOld(axis);
  const tone = old ? 'old' : '';
  const mode = axis.mode === 'none' ? '' : `mode ${axis.mode}`;
  return [
    { text: axis.name, href: `#/axis/${axis.name}`, more: axis.device ? `${axis.device} → ${drive}` : drive },
    { text: axis.cip_state || 'not on a device', tone: stateTone(axis.cip_state || ''), more: axis.display },
    { text: axis.state, tone: stateTone(axis.state) },
    { text: axis.drive_status.join(', ') || 'nothing', tone, more: old ? 'last reported' : mode },
    { text: axis.owner },
    { text: number(axis.position, 6, axis.unit), tone, more: old ? 'last reported' : '' },
    { text: number(axis.velocity, 6, `${axis.unit}/s`), tone },
    { text: number(axis.torque, 1, '%'), tone },
    { text: number(axis.following_error, 6, axis.unit), tone },
  ];
}

function axisNotes(axis) {
  const notes = [];
  if (axis.fault) {
    const code = axis.drive_code
      ? `, the drive says 0x${axis.drive_code.toString(16).toUpperCase().padStart(4, '0')}` : '';
    notes.push(['fault', `Fault ${axis.fault}${code}.`, axis.advice || '']);
  }
  if (axis.waits) notes.push(['waits', 'Waits.', `The axis ${axis.waits}.`]);
  const lacks = axis.inhibits.join(', ');
  // Local control needs no configuration by a controller.
  if (axis.owner === 'nobody' && lacks === 'configuration_incomplete') notes.push(['waits', 'Waits for a controller.', 'Local control can move it.']);
  else if (lacks) notes.push(['waits', 'Cannot be enabled.', lacks]);
  return notes;
}

// Each axis has a row of values, and a row of what is wrong with it.
function showAxes(axes) {
  const table = byId('axis-table');
  const bodies = table.tBodies;
  while (bodies.length > 2 * axes.length) bodies[bodies.length - 1].remove();
  axes.forEach((axis, index) => {
    while (bodies.length < 2 * index + 2) table.appendChild(element('tbody'));
    rows(bodies[2 * index], [axis], labels(AXIS, 5), axisCells);
    showNotes(bodies[2 * index + 1], axisNotes(axis));
  });
}

function showNotes(body, notes) {
  const key = JSON.stringify(notes);
  if (body.dataset.notes === key) return;
  body.dataset.notes = key;
  body.className = 'details';
  body.hidden = notes.length === 0;
  const cell = element('td');
  cell.colSpan = AXIS.length;
  for (const [className, title, text] of notes) {
    const line = cell.appendChild(element('p', className));
    line.appendChild(element('strong', '', title));
    line.append(` ${text}`);
  }
  const row = element('tr');
  row.appendChild(cell);
  body.replaceChildren(row);
}

function showTime(time, target) {
  const pairs = [
    ['Source', time.source],
    ['Synchronized', time.synchronized ? 'yes' : 'no',
      time.synchronized ? 'good' : time.source === 'none' ? '' : 'bad'],
  ];
  if (time.state !== 'synchronized') pairs.push(['State', time.state]);
  if (time.grandmaster !== null) pairs.push(['Grandmaster', time.grandmaster]);
  if (time.offset_ns !== null) pairs.push(['Offset', span(time.offset_ns)]);
  if (time.path_delay_ns !== null) pairs.push(['Path delay', span(time.path_delay_ns)]);
  if (time.error_bound_ns !== null) {
    pairs.push(['Error', `below ${span(time.error_bound_ns)} of ${span(time.threshold_ns)}`]);
  }
  pairs.push(['Steps of the master', whole(time.steps)]);
  list(target, pairs);
}

function showCycles(cycles, target) {
  list(target, [
    ['Shortest cycle', span(cycles.cycle_ns)],
    ['Cycles', whole(cycles.count)],
    ['Late', `${whole(cycles.late)}, the latest by ${span(cycles.latest_ns)}`, lossTone(cycles.late)],
    ['System time', cycles.phase_lock === 'free'
      ? 'not followed' : `${cycles.phase_lock}, ${span(cycles.phase_error_ns)} off`],
    ['Lost updates', whole(cycles.lost_updates), lossTone(cycles.lost_updates)],
    ['Lost telegrams', whole(cycles.lost_telegrams), lossTone(cycles.lost_telegrams)],
    ['Refused frames', whole(cycles.refused_frames)],
    ['Not sent', whole(cycles.send_failures), lossTone(cycles.send_failures)],
  ]);
}

function showHealth(health) {
  const node = byId('health');
  setText(node, health.ready
    ? 'Ready: every bus is in cyclic operation, every axis is commissioned and without fault.'
    : health.alive ? 'Not ready. Missing:' : 'Not alive:');
  setClass(node, health.ready ? 'good' : 'bad');
  const items = byId('missing');
  const texts = health.missing;
  while (items.children.length > texts.length) items.lastElementChild.remove();
  texts.forEach((text, index) => setText(items.children[index] || items.appendChild(element('li')), text));
}

const FAULTS_SHOWN = 20;
const LINES_SHOWN = 30;
const FAULT = ['Axis', 'Fault', 'Came', 'Ended', 'Controller', 'Drive', 'To do'];
const LINE = ['Time', 'Level', 'About', 'Line'];

const when = (time) => new Date(time).toLocaleString();

function showFaults({ faults }) {
  byId('no-faults').hidden = faults.length > 0;
  byId('fault-table').hidden = faults.length === 0;
  rows(byId('faults'), faults.slice(0, FAULTS_SHOWN), labels(FAULT, FAULT.length), (fault) => {
    const code = fault.drive_code ? `0x${fault.drive_code.toString(16).toUpperCase().padStart(4, '0')}` : '';
    return [
      { text: fault.axis, href: `#/axis/${fault.axis}`, more: [fault.bus, fault.drive].filter(Boolean).join(', ') },
      { text: fault.cause, tone: fault.end ? '' : 'bad', more: fault.gateway || '' },
      { text: when(fault.time) },
      fault.end
        ? { text: fault.end.time ? when(fault.end.time) : 'unknown', more: fault.end.by }
        : { text: 'present', tone: 'bad' },
      { text: fault.controller || '' },
      { text: code, more: fault.drive_says || '' },
      { text: fault.advice },
    ];
  });
}

function showLog({ events }) {
  const tone = { error: 'bad', warn: 'warn' };
  rows(byId('log'), [...events].reverse(), labels(LINE, LINE.length), (event) => [
    { text: when(event.time) },
    { text: event.level, tone: tone[event.level] || '' },
    { text: event.axis || event.device || event.bus || event.kind },
    { text: event.text },
  ]);
}

// What was asked for last: a history is fetched when an event says that there is something new.
const seen = { faults: null, log: null };

async function fetchHistory(name, path, number, showIt) {
  if (seen[name] === number) return;
  const before = seen[name];
  seen[name] = number;
  try {
    const answer = await fetch(path);
    if (!answer.ok) throw new Error(answer.statusText);
    showIt(await answer.json());
  } catch {
    // The next event tries again.
    seen[name] = before;
  }
}

// The head of every view.
function showHead({ health, status }) {
  setText(byId('name'), status.name);
  const connected = status.connections === 1 ? '1 controller' : `${status.connections} controllers`;
  // Whether it is ready stands below, with what is missing.
  setText(byId('summary'), `Axisbridge ${status.version}, ${connected}, up ${duration(status.uptime_s)}`);
  const { view, name } = wanted();
  const place = view === 'overview' ? '' : `${name || view} – `;
  document.title = `${place}${status.name}: ${health.ready ? 'ready' : health.alive ? 'not ready' : 'not alive'}`;
}

function showOverview({ health, status, history }) {
  showHealth(health);
  showDevices(status.devices);
  showBuses(status.buses);
  showAxes(status.axes);
  showTime(status.time, byId('time'));
  showCycles(status.cycles, byId('cycles'));
  fetchHistory('faults', '/api/v1/faults', history.faults, showFaults);
  fetchHistory('log', `/api/v1/log?lines=${LINES_SHOWN}`, history.log, showLog);
}

// Whether the next event may be of another process: with another configuration, and counters that begin anew.
let isAnew = false;

// What was fetched once may be of the configuration of before: every view is built again.
function beginAnew(restarted) {
  if (restarted) giveBack('Control was given back: the gateway has started again.');
  seen.faults = seen.log = null;
  mappingView.name = busView.name = null;
  timeView.built = false;
  // A stream of control that is open is one to the same process: the axis goes on, and so does its view.
  if (control.socket === null) {
    axisView.name = null;
    control.offer = null;
  }
  isAnew = false;
}

let source = null;
let lastEventAt = null;
let lastLiveAt = '';

function live() {
  document.body.classList.remove('stale');
  setText(byId('connection'), 'Live');
  lastLiveAt = new Date().toLocaleTimeString();
}

function stale(why) {
  release();
  document.body.classList.add('stale');
  const values = lastLiveAt ? ` The values below are old: they are those of ${lastLiveAt}.` : '';
  setText(byId('connection'), `${why}${values}`);
  document.title = document.title.replace(/: .*/, ': no data');
}

function connect() {
  source = new EventSource('/events');
  source.addEventListener('status', (event) => {
    const look = JSON.parse(event.data);
    const restarted = last && look.status.uptime_s < last.status.uptime_s;
    if (isAnew || restarted) beginAnew(restarted);
    show(look);
    lastEventAt = performance.now();
    if (look.health.alive) live();
    else stale(`The gateway has stopped working: ${look.health.reason}.`);
  });
  source.addEventListener('error', () => {
    isAnew = true;
    stale('No connection to the gateway; trying again.');
    // A browser gives up when it is answered with an error, such as too many viewers.
    if (source.readyState === EventSource.CLOSED) setTimeout(connect, RECONNECT_MS);
  });
}

setInterval(() => {
  const silent = lastEventAt !== null && performance.now() - lastEventAt > STALE_AFTER_MS;
  // Without a connection the page has said so already.
  if (silent && source.readyState === EventSource.OPEN) {
    stale('No data from the gateway.');
  }
}, 500);
connect();
