/// Whippen's language for Tree-sitter: what the compiler's own grammar (`compiler/lang/src/syntax/grammar.lalrpop`)
/// accepts, without its recovery from mistakes. A unit behind a number is read by `src/scanner.c`, because it stands
/// behind exactly one space.

/// Keywords only where the grammar expects them; elsewhere they are names.
const SOFT = [
  'every', 'over', 'slew', 'lasting', 'glide', 'at', 'angle', 'position', 'rate', 'noise', 'delay', 'feed', 'sound',
  'string', 'along', 'density', 'load', 'ends', 'tuned', 'to', 'points', 'inertia', 'mass', 'torque', 'friction',
  'against', 'board', 'device', 'keys', 'programs', 'zones', 'bank', 'table', 'cubic', 'from',
];

/// From the loosest to the tightest.
const PRECEDENCE = { CONDITIONAL: 1, OR: 2, AND: 3, NOT: 4, COMPARISON: 5, SUM: 6, PRODUCT: 7, NEGATION: 8, POWER: 9, POSTFIX: 10 };

/// A list in which a comma may stand behind the last one.
const list = (rule) => optional(seq(rule, repeat(seq(',', rule)), optional(',')));
/// At least one.
const some = (rule) => seq(rule, repeat(seq(',', rule)));

module.exports = grammar({
  name: 'whip',

  externals: ($) => [$.unit],
  extras: ($) => [/[ \t\r\n]/, /\uFEFF/, $.documentation, $.comment],
  word: ($) => $.word,
  supertypes: ($) => [$._expression],
  conflicts: ($) => [
    [$.sense],
    [$.parameter],
  ],

  rules: {
    source_file: ($) => repeat(choice($.instrument, $.term, $.keyboard)),

    documentation: (_) => token(prec(1, /\/\/\/[^\n]*/)),
    comment: (_) => token(/\/\/[^\n]*/),

    // Items

    instrument: ($) => seq('instrument', field('name', $.name), field('body', $.block)),
    term: ($) => seq('term', field('name', $.name), '(', list($.typed_name), ')', '->', some($.typed_name), field('body', $.block)),
    keyboard: ($) => seq('keyboard', field('name', $.name), '{', repeat($._setting), '}'),
    block: ($) => seq('{', repeat($._declaration), '}'),
    typed_name: ($) => seq(field('name', $.name), ':', field('type', $._type)),

    // Declarations

    _declaration: ($) => choice(
      $.sense, $.parameter, $.let, $.states, $.state, $.next, $.body, $.event, $.pulse, $.noise, $.delay, $.table,
      $.feed, $.sound, $.string, $.bank, $.hold, $.force, $.result,
    ),
    sense: ($) => seq('sense', field('name', $.name), ':', field('type', $._type), $._in_range,
      optional(seq('slew', $._expression)), optional(seq('over', $._expression))),
    parameter: ($) => seq(optional('live'), 'param', field('name', $.name), '=', $._expression, optional($._in_range),
      optional(seq('glide', $._expression))),
    let: ($) => seq('let', field('name', $.name), '=', $._expression),
    states: ($) => seq('states', field('name', $.name), '{', repeat($.transition), '}'),
    transition: ($) => seq(field('from', $._state_name), '->', field('to', $._state_name), $._guard, optional($.actions)),
    state: ($) => seq('state', field('name', $.name), ':', field('type', $._type), $._in_range, optional(seq('=', $._expression))),
    next: ($) => seq('next', field('name', $.name), '=', $._expression),
    event: ($) => seq('event', field('name', $.name), choice($._guard, seq('every', $._expression)), optional($.actions)),
    pulse: ($) => seq('pulse', field('name', $.name), ':', field('type', $._type), $._in_range, 'lasting', $._expression),
    noise: ($) => seq('noise', field('name', $.name)),
    delay: ($) => seq('delay', field('name', $.name), ':', field('type', $._type), $._in_range, 'lasting', $._expression),
    table: ($) => seq('table', field('name', $.name), ':', field('type', $._type), 'over', field('over', $._type), optional('cubic'),
      choice(seq('{', list($.knot), '}'), seq('from', $.file))),
    knot: ($) => seq($._expression, ':', $._expression),
    feed: ($) => seq('feed', field('name', $.name), '=', $._expression),
    sound: ($) => seq('sound', field('name', $.name), optional(seq('on', $.name)), '=', $._expression),
    bank: ($) => seq('bank', field('name', $.name), 'over', field('index', $.name), $._in_range, field('body', $.block)),
    hold: ($) => seq('hold', field('name', $.name), $._guard),
    force: ($) => seq(choice('force', 'torque'), field('name', $.name), optional(seq('on', $.name)), '=', $._expression),
    result: ($) => seq(field('name', $.name), '=', $._expression),

    body: ($) => seq('body', field('name', $.name), '{',
      repeat(choice($.coordinate, $.inertia, $.drive, $.friction)), '}'),
    coordinate: ($) => seq(choice('angle', 'position'), field('name', $.name), $._in_range, optional(seq('=', $._expression)),
      ',', 'rate', $._in_range, optional(seq('=', $._expression))),
    inertia: ($) => seq(choice('inertia', 'mass'), $._expression),
    drive: ($) => seq(choice('torque', 'force'), $._expression),
    friction: ($) => seq('friction', field('name', $.name), '(', field('slip', $.name), ')',
      optional(seq('at', $._expression)), 'against', $._expression, '=', $._expression),

    string: ($) => seq('string', field('name', $.name), 'along', $.range, '{', repeat($._string_part), '}'),
    _string_part: ($) => choice($.motion, $.density, $.load, $.push, $.ends, $.tuned, $.friction, $.points),
    motion: ($) => seq('position', field('name', $.name), $._in_range, ',', 'rate', $._in_range),
    density: ($) => seq('density', $._expression),
    load: ($) => seq('load', $._expression),
    push: ($) => seq('force', $._expression, 'at', $._expression),
    ends: ($) => seq('ends', $.name, optional(seq(',', $.name))),
    tuned: ($) => seq('tuned', field('name', $.name), 'to', $._expression),
    points: ($) => seq('points', $._expression),

    // Events

    _guard: ($) => seq('when', $._expression),
    actions: ($) => seq('{', repeat(choice($.emit, $.write, $.fire)), '}'),
    emit: ($) => seq('emit', field('name', $._state_name), '(', list($.emitted), ')'),
    emitted: ($) => seq(field('name', $.name), ':', $._expression),
    write: ($) => seq(field('name', $.name), optional("'"), ':=', $._expression),
    fire: ($) => seq('fire', field('name', $.name), 'at', $._expression),

    // Keyboards

    _setting: ($) => choice($._setting_with_keyword, $.values_per_key),
    _setting_with_keyword: ($) => choice($.board, $.device, $.rate, $.keys, $.programs, $.zones),
    board: ($) => seq('board', $.name, optional(seq('*', field('chips', $.quantity)))),
    device: ($) => seq('device', choice($.name, $.file)),
    rate: ($) => seq('rate', $._expression),
    keys: ($) => seq('keys', $._note, '..', $._note),
    programs: ($) => seq('programs', some($.name)),
    zones: ($) => seq('zones', field('name', $.name), '=', '{', list($.zone), '}'),
    zone: ($) => seq($._note, '..', $._note, ':', field('instrument', $.name)),
    values_per_key: ($) => seq(field('instrument', $.name), '.', field('parameter', $.name), '=', '{', list($.value_of_key), '}'),
    value_of_key: ($) => seq($._note, ':', $._expression),
    _note: ($) => choice($.name, $.note),

    // Expressions

    _in_range: ($) => seq('in', $.range),
    range: ($) => seq($._expression, '..', $._expression),

    _expression: ($) => choice(
      $.conditional, $.binary, $.negation, $.state_test, $.prime, $.field, $.member, $.quantity, $.switch, $.name, $.call, $.group,
    ),
    conditional: ($) => prec.right(PRECEDENCE.CONDITIONAL, seq('if', $._expression, 'then', $._expression, 'else', $._expression)),
    binary: ($) => choice(
      ...[
        ['or', PRECEDENCE.OR, prec.left], ['and', PRECEDENCE.AND, prec.left],
        ['<', PRECEDENCE.COMPARISON, prec.left], ['<=', PRECEDENCE.COMPARISON, prec.left],
        ['>', PRECEDENCE.COMPARISON, prec.left], ['>=', PRECEDENCE.COMPARISON, prec.left],
        ['+', PRECEDENCE.SUM, prec.left], ['-', PRECEDENCE.SUM, prec.left],
        ['*', PRECEDENCE.PRODUCT, prec.left], ['/', PRECEDENCE.PRODUCT, prec.left],
        ['^', PRECEDENCE.POWER, prec.right],
      ].map(([sign, level, order]) => order(level, seq($._expression, field('operator', sign), $._expression))),
    ),
    negation: ($) => choice(
      prec(PRECEDENCE.NOT, seq('not', $._expression)),
      prec(PRECEDENCE.NEGATION, seq('-', $._expression)),
    ),
    state_test: ($) => prec(PRECEDENCE.COMPARISON, seq(field('machine', $.name), 'is', optional('not'), field('state', $._state_name))),
    prime: ($) => prec(PRECEDENCE.POSTFIX, seq($._expression, "'")),
    field: ($) => prec(PRECEDENCE.POSTFIX, seq($._expression, '.', field('name', $.name))),
    member: ($) => prec(PRECEDENCE.POSTFIX, seq($._expression, '[', $._expression, ']')),
    quantity: ($) => prec.right(seq($.number, optional($.unit))),
    switch: (_) => choice('on', 'off'),
    call: ($) => prec(PRECEDENCE.POSTFIX, seq(field('term', $.name), '(', list($._argument), ')')),
    _argument: ($) => choice($._expression, $.named_argument),
    named_argument: ($) => seq(field('name', $.name), ':', $._expression),
    group: ($) => seq('(', $._expression, ')'),

    // Names

    _type: ($) => choice($.type, $.unit_type),
    type: ($) => choice($.name, 'force'),
    // `kg/m`, `1/s`, `m^2`: more than a name.
    unit_type: ($) => choice($._unit_power, seq($._unit_factor, repeat1(seq(choice('*', '/'), $._unit_factor)))),
    _unit_factor: ($) => choice($.number, $.name, $._unit_power),
    _unit_power: ($) => seq($.name, '^', optional('-'), $.number),

    _state_name: ($) => choice($.name, alias('on', $.name), alias('off', $.name)),
    name: ($) => choice($.word, ...SOFT),
    word: (_) => /[A-Za-z_][A-Za-z0-9_]*/,
    note: (_) => /[A-G]#[0-9]+/,
    number: (_) => /[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?/,
    file: (_) => /"[^"\n]*"/,
  },
});
