
// ---- an axis: state, faults, the last minute, limits, parameters ----------------------------------------------

const MINUTE = 60;
const SAMPLE = 0.1;
const AXIS_FAULTS_SHOWN = 10;

const axisView = { name: null };

function buildAxis(name) {
  const view = byId('view-axis');
  const node = head(view, name, axisChoice('axis', name));
  const state = section(view, 'axis-state', 'State', true);
  const levels = state.appendChild(element('div', 'levels'));
  const level = ['Controller sees', 'Generic model', 'Drive reports'].map((title) => {
    const part = levels.appendChild(element('div'));
    part.appendChild(element('h3', '', title));
    return [part.appendChild(element('p')), part.appendChild(element('small'))];
  });
  const notes = state.appendChild(element('table')).appendChild(element('tbody'));
  buildControl(section(view, 'axis-control', 'Local control', true), name);
  const faults = section(view, 'axis-faults', 'Faults', true);
  const charts = section(view, 'axis-traces', 'Last minute', true).appendChild(element('div', 'charts'));
  const traces = [
    { title: 'Position', names: ['actual', 'command'], keys: ['position', 'position_command'], per: '', least: 0.001, digits: 4 },
    { title: 'Velocity', names: ['actual', 'command'], keys: ['velocity', 'velocity_command'], per: '/s', least: 0.01, digits: 3 },
    { title: 'Torque', names: ['actual', 'command'], keys: ['torque', 'torque_command'], unit: '%', least: 1, digits: 1 },
    { title: 'Following error', names: ['actual'], keys: ['following_error'], per: '', least: 0.0001, digits: 6 },
  ].map((trace) => {
    const chart = figure(trace.title, trace.names);
    charts.appendChild(chart.node);
    return { ...trace, chart };
  });
  Object.assign(axisView, {
    name,
    subtitle: node,
    level,
    notes,
    faults,
    traces,
    values: section(view, 'axis-values', 'Values').appendChild(element('dl')),
    limits: section(view, 'axis-limits', 'Limits').appendChild(element('dl')),
    samples: new Samples(`/api/v1/traces?axis=${name}&`, MINUTE / SAMPLE),
    reported: {},
    sheet: null,
    asked: false,
    seen: null,
  });
  buildParameters(section(view, 'axis-parameters', 'Parameters of the drive', true), name);
}

function showAxis({ status, history }, name) {
  const axis = status.axes.find((known) => known.name === name);
  if (!axis) return unknown(`There is no axis ${name}.`);
  if (axisView.name !== name) buildAxis(name);
  askSheet(axisView, (sheet) => {
    axisView.sheet = sheet;
    suggest(sheet.limits);
  });
  const place = [axis.bus, axis.drive, axis.address].filter(Boolean).join(', ');
  setText(axisView.subtitle, axis.device ? `${axis.device} → ${place}` : place);
  const [controller, generic, drive] = axisView.level;
  const old = isOld(axis);
  const fill = ([value, more], text, tone, small) => {
    setText(value, text);
    setClass(value, tone);
    setText(more, small);
  };
  fill(controller, axis.cip_state || 'not on a device', stateTone(axis.cip_state || ''),
    [axis.display && `display ${axis.display}`, axis.axis_status && `axis status ${axis.axis_status}`].filter(Boolean).join(', '));
  fill(generic, axis.state, stateTone(axis.state), `owner ${axis.owner}, mode ${axis.mode}`);
  fill(drive, axis.drive_status.join(', ') || 'nothing', old ? 'old' : '',
    [old ? 'last reported' : '', axis.node ? `node ${axis.node.state}` : ''].filter(Boolean).join(', '));
  showNotes(axisView.notes, axisNotes(axis));
  showControl(axis);
  showParameters();
  showAxisValues(axis);
  showLimits(axis);
  if (axisView.seen !== history.faults) {
    const number = history.faults;
    axisView.seen = number;
    fetchOnce(`/api/v1/faults?axis=${name}`, showAxisFaults, () => { axisView.seen = null; });
  }
  axisView.samples.update().then((fresh) => {
    if (fresh && axisView.name === name) drawAxis(axis.unit);
  });
  return undefined;
}

function drawAxis(unit) {
  const lists = axisView.samples.lists;
  for (const trace of axisView.traces) {
    const of = trace.unit || `${unit}${trace.per}`;
    const series = trace.keys.map((key) => lists[key]);
    series.forEach((values, index) => {
      const value = values.length ? values[values.length - 1] : null;
      const text = value === null ? 'none' : number(value, trace.digits, of);
      setText(trace.chart.keys[index], `${trace.names[index]} ${text}`);
    });
    drawLines(trace.chart, { times: lists.uptime_s, series, span: MINUTE, period: SAMPLE, least: trace.least, unit: of });
  }
}

const optional = (value, digits, unit) => (value === null || value === undefined ? 'none' : number(value, digits, unit));

// Whether the telegram of the drive has had this value last; of a drive that is not heard, before it was lost.
function isReported(axis, key) {
  const values = axisView.samples.lists ? axisView.samples.lists[key] : [];
  if (values.length > 0 && !isOld(axis)) axisView.reported[key] = values[values.length - 1] !== null;
  return axisView.reported[key] !== false;
}

function showAxisValues(axis) {
  const { unit } = axis;
  const [tone, more] = isOld(axis) ? ['old', ', last reported'] : ['', ''];
  const reported = (name, text) => [name, `${text}${more}`, tone];
  const ifReported = (key, name, text) => (isReported(axis, key) ? reported(name, text) : [name, 'not reported']);
  const pairs = [
    reported('Position', number(axis.position, 6, unit)),
    ['Position command', optional(axis.position_command, 6, unit)],
    ifReported('velocity', 'Velocity', number(axis.velocity, 6, `${unit}/s`)),
    ['Velocity command', optional(axis.velocity_command, 6, `${unit}/s`)],
    ifReported('torque', 'Torque', number(axis.torque, 1, '%')),
    ['Torque command', optional(axis.torque_command, 1, '%')],
    ifReported('following_error', 'Following error', number(axis.following_error, 6, unit)),
  ];
  if (axis.current !== null) pairs.push(reported('Current', number(axis.current, 2, 'A')));
  if (axis.bus_voltage !== null) pairs.push(reported('DC bus', number(axis.bus_voltage, 1, 'V')));
  if (axis.temperature !== null) pairs.push(reported('Motor', number(axis.temperature, 1, '°C')));
  pairs.push(['Lost telegrams', whole(axis.lost_telegrams), lossTone(axis.lost_telegrams)]);
  pairs.push(['Faults so far', whole(axis.faults)]);
  list(axisView.values, pairs);
}

function showLimits(axis) {
  if (!axisView.sheet) return;
  const { limits } = axisView.sheet;
  const { unit } = axis;
  const of = (value, digits, per) => (value === null ? 'the drive’s' : number(value, digits, per));
  const reached = axis.drive_status.filter((bit) => /limit$|limit_switch$/.test(bit));
  list(axisView.limits, [
    ['Lowest position', of(limits.position_min, 3, unit)],
    ['Highest position', of(limits.position_max, 3, unit)],
    ['Velocity', of(limits.velocity, 3, `${unit}/s`)],
    ['Acceleration', of(limits.acceleration, 1, `${unit}/s²`)],
    ['Torque', of(limits.torque, 1, '%')],
    ['Following error', of(limits.following_error, 6, unit)],
    isOld(axis) ? ['Reached', `${reached.join(', ') || 'none'}, last reported`, 'old']
      : ['Reached now', reached.join(', ') || 'none', reached.length ? 'warn' : ''],
    ['Inhibits', axis.inhibits.join(', ') || 'none', axis.inhibits.length ? 'warn' : ''],
  ]);
}

// Each fault in three words: the controller's, those of the generic model, the drive's.
function showAxisFaults({ faults }) {
  const nodes = faults.slice(0, AXIS_FAULTS_SHOWN).map((fault) => {
    const node = element('div', 'words');
    const ended = fault.end ? `${fault.end.time ? when(fault.end.time) : 'ended'}, ${fault.end.by}` : 'present';
    node.appendChild(element('p', fault.end ? '' : 'bad', `${when(fault.time)} – ${ended}`));
    const code = hex(fault.drive_code);
    const words = [
      ['Controller', fault.controller || 'not reported'],
      ['Generic model', fault.gateway || fault.cause],
      ['Drive', [code, fault.drive_says].filter(Boolean).join(' ') || 'reports no code'],
    ];
    for (const [title, text] of words) {
      const part = node.appendChild(element('div'));
      part.appendChild(element('h3', '', title));
      part.appendChild(element('p', '', text));
    }
    node.appendChild(element('p', '', fault.advice));
    return node;
  });
  if (!nodes.length) nodes.push(element('p', '', 'No fault is in the history.'));
  axisView.faults.replaceChildren(axisView.faults.firstElementChild, ...nodes);
}
