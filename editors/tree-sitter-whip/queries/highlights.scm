; Names of captures are those that editors share (Neovim, Helix, Zed).

(documentation) @comment.documentation
(comment) @comment
(number) @number
(unit) @type.builtin
(switch) @boolean
(file) @string
(note) @constant

["instrument" "term" "keyboard" "sense" "live" "param" "let" "body" "states" "state" "next" "event" "emit" "pulse"
 "fire" "force" "hold" "noise" "delay" "feed" "sound" "string" "bank" "table" "friction" "torque" "inertia" "mass"
 "angle" "position" "rate" "density" "load" "ends" "tuned" "points" "board" "device" "keys" "programs" "zones"] @keyword
["when" "every" "if" "then" "else"] @keyword.conditional
["and" "or" "not" "is" "in" "on" "over" "slew" "lasting" "glide" "at" "along" "to" "against" "cubic" "from"] @keyword.operator
["+" "-" "*" "/" "^" "<" "<=" ">" ">=" "=" ":=" "->" ".." "'"] @operator
["(" ")" "[" "]" "{" "}"] @punctuation.bracket
["," ":" "."] @punctuation.delimiter

(name) @variable
(instrument name: (name) @type)
(keyboard name: (name) @type)
(term name: (name) @function)
(call term: (name) @function.call)
(named_argument name: (name) @variable.parameter)
(emitted name: (name) @variable.parameter)
(typed_name name: (name) @variable.parameter)
(field name: (name) @variable.member)
(type) @type
(unit_type) @type
(emit name: (name) @function.call)
(transition from: (name) @constant)
(transition to: (name) @constant)
(state_test state: (name) @constant)
