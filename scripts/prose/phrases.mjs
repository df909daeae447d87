// Phrases that make a reader translate, with the better wording. `find` is matched in running text: code spans, links' addresses and
// code are left out, and a space matches a line break, too. `bad` is found by its rule and `good` passes all of them; the tests see to that.
// `word` names the entry of the glossary's column "not" that the rule is for, where the word alone has legitimate meanings.
// `only` is the kind of text that the rule is for, `files` their paths; `except` are legitimate uses, each with a reason and an example.

/** Rules of words that have a legitimate meaning besides the one that is not used. */
const WORDS = [
  {
    word: 'way',
    find: /\b(goes|go|going) (so|this|that) far\b|\b(the|its|their|a vertex's|each vertex's) ways? (of|to) (a|the|each|every|all) (vertex|vertices|position|place)s?\b|\bcarr(y|ies|ied) (along )?(their|its) ways?\b|\bways? of the vertices\b/i,
    use: 'displacement; moves by',
    bad: 'Vertices whose way is short: the ways of the vertices are halved.',
    good: 'Displacements of the vertices are halved.',
  },
  {
    word: 'place',
    find: /\bplaces? (of|for) (a|an|the|each|every|all|its|their|new|other) (new |other |moved )?(vertex|vertices|corner|corners|point|points)\b|\b(vertex|vertices|corner|point)s?['’]s? places?\b|\b(another|same|equal|different|of equal) places? (of|for|as) (a|the) (collapsed|vertex|edge)|\bplaces? (left|to be left) out\b/i,
    use: 'position (of a vertex), location',
    bad: 'The places of the vertices are rounded.',
    good: 'The positions of the vertices are rounded, and the header takes the place of the file name.',
  },
  {
    word: 'room',
    find: /\b(no|less|more|some|enough|with|its|their|the) room (to|for) (move|moving|motion|it to move)\b|\broom (is |was )?(left|used up|spent)\b|\bspends? (its |their |the )?room\b/i,
    use: 'motion bound (collision handling), capacity (of a buffer), padding, margin',
    bad: 'A vertex with no room to move is tested again when its room is used up.',
    good: 'A vertex is tested again when its motion bound is used up. There is no room for a legend.',
  },
  {
    word: 'doubt',
    find: /\b(in|with|of|without|no) doubts? (about|of|on|over) (a|the|each|which|its) (vertex|vertices|pair|pairs|triangle|triangles)\b|\b(vertices|pairs|triangles) in doubt\b|\bdoubtful (vertices|pairs)\b/i,
    use: 'dirty (vertices), pairs to be tested',
    bad: 'Vertices in doubt are tested.',
    good: 'Dirty vertices are tested; without doubt this is cheap.',
  },
  {
    word: 'look',
    find: /\b(looks?|looked|looking) at (it|them|all|each|every|two|pairs?|triangles?|vertices|a vertex|the (vertex|vertices|mesh|surface|pairs?))\b|\b(was|were|is|are|be|been) looked (at|for)\b|\blooks? (only|again)\b|\bonly look\b|\bindependent look\b/i,
    use: 'tests, checks, visits, queries; is searched for; Navigate (mode of the mouse)',
    bad: 'What was looked at: each vertex looks at its neighbours; all of them are looked at.',
    good: 'Each vertex is tested against its neighbours. A camera that looks at the origin. Have a look at the example.',
  },
  {
    word: 'star',
    find: /\b(the|a|its|their|one|whose|each|every|of) stars? (of|around) (a|an|the|each|every|its|all) (vertex|vertices|corner|edge)|\bstar of (a|the|each) \w+ vertex\b/i,
    use: 'one-ring (neighbours), vertex ball (bounding ball), facets of a vertex',
    bad: 'The star of a vertex is bounded by a ball.',
    good: 'The one-ring of a vertex is bounded by a ball.',
  },
  {
    word: 'company',
    find: /\b(have|has|in|seeks?|finds?|without) company\b|\bcompany of (a|the|each) (vertex|vertices)\b/i,
    use: 'contact query, pairs in contact',
    bad: 'Vertices that have company are listed.',
    good: 'Vertices in contact are listed.',
  },
  {
    word: 'terrain',
    find: /\b(a|the|its) terrain (of|that|is|around)\b/i,
    use: 'SurfaceWalker',
    bad: 'The terrain of the input surface.',
    good: 'A walker over the input surface.',
  },
  {
    word: 'march',
    find: /\b(march|marches|marched|marching) (over|from|along|on|to|across|towards)\b/i,
    use: 'walk (over a surface)',
    bad: 'A point that marches over the surface.',
    good: 'A point that walks over the surface. A mesh from marching cubes.',
  },
  {
    word: 'foot',
    find: /\b(foot|feet) of (a|the|each|its) (point|vertex|perpendicular|normal)\b|\b(its|their|whose|the) (foot|feet) on (a|the|it|its)\b|\b(foot|feet) on the (surface|base|mesh)\b/i,
    use: 'closest point',
    bad: 'The foot of the point on the surface.',
    good: 'The closest point on the surface. A pool at the foot of the lamp.',
  },
  {
    word: 'danger',
    find: /\b(in|of|out of) danger\b/i,
    use: 'conflict mask; within its conflict mask',
    bad: 'Vertices in danger are left out.',
    good: 'Vertices in the conflict mask are left out.',
  },
  {
    word: 'sharpness',
    find: /\b(sharpens?|sharpened|blunts?|blunted|sharpness|bluntness) (of )?(a |the |its |all |each )?(triangle|triangles|angle|angles|corner|corners)\b|\b(sharp|blunt) triangles?\b/i,
    use: 'minimum-angle optimisation, angle quality',
    bad: 'The sharpness of triangles is the least of their angles.',
    good: 'The angle quality of a triangle is the squared sine of its smallest angle.',
  },
  {
    word: 'parting',
    find: /\b(parting|partings) (of|are|is|and|or)\b/i,
    use: 'topology change, cut, separation',
    bad: 'Parting is allowed where the image shows two parts.',
    good: 'Cuts are allowed where the image shows two components.',
  },
  {
    word: 'crevice',
    find: /\bcrevices? (opens?|closes?|that (opens?|closes?))\b|\b(a|the|of|in|every) crevices?\b(?! (between|of the (heart|muscle)))/i,
    use: 'boundary loss (of a tracked surface); gap',
    bad: 'In a crevice the surface has no boundary.',
    good: 'Where the boundary is lost the surface is collapsed. The papillary muscles have crevices between them.',
  },
  {
    word: 'crossings',
    find: /\b(number|count|counts|counted|exact count|total) of (all )?crossings\b|\b(no|any|without|zero|0|few|finds|found|count|counts|exact|has|have|its|their|hundred|\d+) crossings\b|\bcrossings (are|were|in|of|that|remain|left)\b/i,
    use: 'self-intersections (their count), crossing pairs of triangles',
    bad: 'The mesh has no crossings.',
    good: 'The mesh has no self-intersections. Crossing pairs of triangles are counted. Iso crossings of an edge.',
    except: [
      {
        find: /\b(iso|zero|edge|contour|parity)[- ]crossings|crossings of (a|the) (line|lattice|edge|edges)/i,
        because: 'an edge or a line crosses a surface',
        good: 'A cell has three zero crossings.',
      },
    ],
  },
  {
    word: 'crosses itself',
    find: /\b(cross|crosses|crossed|crossing) (itself|themselves|each other|one another)\b|\bnothing (ever )?crosses\b|\b(that|whether|where|if|no) (triangles?|sheets|edits?) (would )?cross(es)?\b(?! (the|a|an|its))/i,
    use: 'intersects itself, triangles intersect',
    bad: 'The mesh crosses itself: nothing crosses at first.',
    good: 'The mesh intersects itself. An edge that crosses the plane is split.',
  },
  {
    word: 'skin',
    find: /\b(bare|lone|control|own|shown|outer|finer?|coarse|far|random|new|whole) skins?\b(?! (of|and) (the )?(head|skull))|\bskins? (is|are|was|were|that|would|stays|slips?|goes|over|between|moves|follows|makes|spans|itself|alone|lies|without|with)\b|\b(frames?|edges?|vertices|levels?|triangles?|film) of (a|the) skins?\b|\bthan the skin\b/i,
    use: 'membrane, surface (of the model); the paper’s S',
    bad: 'The skin is solved on coarse levels first; a bare skin has no detail.',
    good: 'The membrane is solved on coarse levels first. Skull or skin, as the iso-value says. A skin of 4 % of the ordinary edge.',
    except: [
      {
        find: /\bskin (is|was) (not )?(used up|renewed|searched)|\bskin of the broad phase|\bwider skin|\bskin of \d/i,
        because: 'the skin distance of the broad phase',
        good: 'Vertices whose skin is used up are searched for.',
      },
    ],
  },
  {
    word: 'votes',
    find: /\bvotes? (of|for) (the )?sides?\b|\bsides? (is|are) voted\b/i,
    use: 'boundary votes; inside/outside labelling',
    bad: 'The votes of sides decide.',
    good: 'Boundary votes decide.',
  },
  {
    word: 'residual',
    find: /\bResidual to (reach|come to)\b|^Residual$/,
    only: 'strings',
    files: /params\.rs$/,
    use: 'Tolerance (the parameter); residual is what is measured',
    bad: 'Residual',
    good: 'Relative residual of the solve',
  },
  {
    word: 'picture',
    find: /\b(the|a|both|two|one|each|same|medical|grey) pictures? (is|are|shows?|has|have|says?|agrees?|sequences?|volumes?|gradients?|forces?) (bright|dark|flat|noisy|there|nothing)|\bpicture (gradient|force|stack)\b/i,
    use: 'image (the data); figure (in the documentation)',
    bad: 'Where the picture is flat, edges are longer.',
    good: 'Where the image is flat, edges are longer. Pictures of the figure are shown beside it.',
  },
  {
    word: 'hollow',
    find: /\bhollows\b|\b(a|the|each|every|no|in a|small) hollow\b(?! (sphere|cylinder|bone|tube|shell|cube|ball|box))|\bhollow that\b/i,
    use: 'cavity',
    bad: 'Parts and hollows are added; a solid in a hollow stays.',
    good: 'Components and cavities are added; a hollow sphere has one cavity.',
  },
  {
    word: 'hand',
    find: /\bhand's|\bthe hand (moves?|lets?|turns?|drags?|is|stops?|goes|rests|has)|\b(while|when|until|as|before|after|where|since|if) (a|the) hand\b|\banswers? (to|of) the hand\b|\bby a hand\b|\bsculptor['’]s hand\b/i,
    use: 'drag, pointer, the user; drag latency',
    bad: 'While a hand turns it; the answer to the hand.',
    good: 'While the user drags it; the drag latency. It was checked by hand. On the other hand, it is slow.',
  },
  {
    word: 'film',
    find: /\b(4D|beating|cine|medical|heart's|MR) films?\b|\bfilms? of (a|the) (heart|beat|volume|image)\b/i,
    use: '4D image, sequence (Track); animation (Sculpt)',
    bad: 'A film of a heart is opened.',
    good: 'A 4D image of a heart is opened; the film of the lava lamp plays.',
  },
];

/** Rules of phrases and turns of sentences. */
const SENTENCES = [
  {
    find: /(?:^|[.:;] )Given (are|is)\b|(?:^|[.:;] )Looked for (are|is)\b|(?:^|[.:;] )Wanted (are|is)\b/,
    use: 'start with the subject: "Given noisy points, find a smooth closed surface near them."',
    bad: 'Given are points near a surface. Looked for is that surface.',
    good: 'Given noisy points, find a smooth closed surface near them. If no base is given, one is made.',
  },
  {
    find: /\b(what|whatever) (came|comes|has come|becomes|became|will become) (out )?of (it|them|this|that|a|an|the|all|each|its)\b|\bwhat came out\b/i,
    use: 'the results',
    bad: 'Draws what came of it.',
    good: 'Plots the results.',
  },
  {
    find: /\bmeans? harm\b|\bmeant to harm\b|\bmean(s|ing)? (no )?(ill|evil)\b/i,
    use: 'malicious input',
    bad: 'Bytes that mean harm are refused.',
    good: 'Malicious input is rejected.',
  },
  {
    find: /\bwhere nothing (else )?is (said|asked|given|told|named|chosen|asked for)\b|\bunless something else is said\b/i,
    use: 'by default',
    bad: 'It is 0.2 where nothing is said.',
    good: 'It is 0.2 by default.',
  },
  {
    find: /\b(goes?|went|going|moves?|is|are|come|comes) by so (much|many)\b|\bso much (less|more|further|farther|longer|shorter|nearer)( far)?\b/i,
    use: 'is scaled by this factor; moves by this distance',
    bad: 'Each step goes by so much less far than the one before.',
    good: 'Each step is scaled by this factor.',
  },
  {
    find: /\b(for|of|by|after|about|with|in|has|have|to|until|than|from|at|than) so (many|much)\b|(?:^|[.:;] )So (many|much)\b/,
    use: '"this number of", "n"',
    bad: 'Bounds of edges for so many triangles. So many frames are tracked.',
    good: 'Bounds of edges for a number of triangles. There are so many triangles that it takes a second.',
  },
  {
    find: /\band the like\b|\bor the like\b|\band such like\b/i,
    use: 'name them, or "etc."',
    bad: 'Normals, colours and the like.',
    good: 'Normals and colours. It gives something like the original.',
  },
  {
    find: /\b(come|comes|came|coming|has come|have come) to rest\b|\b(vertex|surface|mesh|model|membrane) rests\b|\b(is|are|was|were|be|been|not|vertices|surface|model|all|everything|missing) at rest\b|\bits rest\b|\bat rest (again|after|on)\b|\blets? rest\b|^At rest\b/i,
    use: 'converges, has converged (a level, a run); settles, has settled (a vertex)',
    bad: 'The surface comes to rest: vertices at rest sleep.',
    good: 'The run converges: settled vertices sleep. The rest of them is tested.',
    except: [
      {
        find: /\bsprings? (is|are) at rest|length at rest/i,
        because: 'the rest length of a spring',
        good: 'The length at which springs are at rest.',
      },
    ],
  },
  {
    find: /\bstands? (\w+ )?(above|below|up to|beyond) \d/i,
    use: '"remains stable for"',
    bad: 'Runge–Kutta stands rigidity above 0.4: it stands rigidity above 0.4.',
    good: 'Runge–Kutta remains stable for rigidity above 0.4.',
  },
  {
    find: /\b(quick|cheap|fast|cheaper) tests? (stand|stands|go|goes) before\b|\berrs? on one side only\b|\bhow far all may (go|move)\b|\btells? how far all\b/i,
    use: '"conservative filters run first; each returns a displacement bound"',
    bad: 'Quick tests stand before them which err on one side only and tell how far all may go.',
    good: 'Conservative filters run first; each returns a displacement bound.',
  },
  {
    find: /(?:^|[.:] )What holds\b/,
    only: 'markdown',
    use: '"Verified claims and how to reproduce them"',
    bad: 'What holds, and the command that shows it',
    good: 'Verified claims and how to reproduce them',
  },
  {
    find: /^(What|Of what|Who|Whom)\b(?![^.?!]*\?)/,
    only: 'comments',
    use: 'start with a verb or a noun: "Returns the files of …", "The parameters of …"',
    bad: 'What is kept of a run',
    good: 'State of a run that is saved. What does it cost?',
  },
  {
    find: /\bsuch as (are|is|were)\b/i,
    use: '"those that are", or an example after "such as"',
    bad: 'Files such as are found in archives.',
    good: 'Files such as NIfTI volumes.',
  },
  {
    find: /\b(is|are|was|were|be) taken for\b|\b(takes?|took|taking) (it|them|this|that|these|those) for (a|an|the|noise|one)\b/i,
    use: '"treats as", "is treated as"',
    bad: 'Small parts are taken for noise.',
    good: 'Small parts are treated as noise.',
    except: [
      {
        find: /\btaken for (each|every|granted|\d+)\b/i,
        because: '"taken" in its own sense',
        good: 'An average is taken for each frame.',
      },
    ],
  },
  {
    find: /\blies? (side )?by (a|an|the|its|their|each)\b/i,
    use: '"is beside", "is near"',
    bad: 'The header lies by the data.',
    good: 'The header is beside the data.',
  },
  {
    find: /\b(mesh|surface|vertex|vertice|solver|pass|edit|test|level|triangle|edge|filter|loop|function|kernel)e?s? (asks?|wants?|longs?|wishes|goes home|go home)\b/i,
    use: 'tests, queries, needs, returns: "The pass tests …"',
    bad: 'The filter asks whether it is near; the surface wants to grow.',
    good: 'The filter tests whether it is near; the page asks for a file.',
  },
  {
    find: /\bin their own units\b/i,
    use: 'name the unit',
    bad: 'Lengths in their own units.',
    good: 'Lengths in the points’ units.',
  },
  {
    find: /\bleft (just )?as (it|they) (is|are|was|were)\b|\b(stays?|stayed|kept|keeps?|remains?) as (it|they) (is|are|was|were)\b|\b(run|mesh|model|surface|volume|file|view|page) as (it|they) (is|are|was|were)\b/i,
    use: '"unchanged"',
    bad: 'The base stays as it is.',
    good: 'The base is unchanged. Use it as far as it is known.',
  },
  {
    find: /\bget(s)? to know\b|\bis (made |becomes )?known of\b|\bwhat is known of (each|it|them)\b/i,
    use: 'say what is known: "limitations of each host"',
    bad: 'What is known of each',
    good: 'Limitations of each host',
  },
  {
    find: /\b(takes?|took|taken|taking) (all |everything |it |them )?back\b/i,
    use: '"undoes", "rolls back", "discards"',
    bad: 'The edit is taken back.',
    good: 'The edit is rolled back.',
    except: [
      {
        find: /\btaken back (to|into) (the |its )?(first|frame|contour|host)/i,
        because: 'a movement',
        good: 'The surface is taken back to the first frame.',
      },
    ],
  },
  {
    find: /\b(drawn?|draws|drew|drawing) together\b/i,
    use: '"collapsed"',
    bad: 'Shorter edges are drawn together.',
    good: 'Shorter edges are collapsed.',
  },
  {
    find: /\bany ?more so\b|\bgo(es|ing)? (forth|home)( again)?\b|\baway with (the|it|them)\b/i,
    use: '"continues", "redone", "dismiss"',
    bad: 'Going forth again; away with the message.',
    good: 'Redone. Dismiss the message.',
  },
  {
    find: /\bthat cannot be\b(?! \w+(ed|en|ught|ne|wn|de|id|ad|nt|nd|ut|one)\b)/i,
    use: '"is not possible", "was rejected"',
    bad: 'That cannot be.',
    good: 'Settings rejected. A file that cannot be read is named.',
  },
  {
    find: /\b(made|begun|found|computed|built|started|drawn|taken|loaded|asked for|sampled|decided|makes|begins|finds|computes|asks) anew\b/i,
    use: '"recomputed", "restarted", "again"',
    bad: 'The view is made anew.',
    good: 'The view is recreated.',
  },
  {
    find: /\b(are|is|was|were|once) mended\b|\bmends? (it|them|the|a)\b/i,
    use: '"fixed", "repaired"',
    bad: 'Once it is mended it gets a test.',
    good: 'Once it is fixed it gets a test. We recommend the default.',
  },
  {
    find: /\bmore (\w+ )?than (can be had|there (is|are))\b(?! \w)/i,
    use: '"more than is available"',
    bad: 'It needs 8 GB, more than there is.',
    good: 'It needs 8 GB, more than is available. There are no more frames than there are vertices.',
  },
  {
    find: /\bgiven[;,:] .*\b(accepted|needed|possible)\b|\bgiven; (a|an|finite|one|at)\b/i,
    only: 'strings',
    use: '"must be <range>, got <value>"',
    bad: '… given, 1 to 16 accepted',
    good: 'must be 1 to 16, got …',
  },
  {
    find: /; [^;]* (is|are) accepted\b|\bnumbers?( \w+)* (is|are) needed\b|; at least \S+ are needed\b|\b(up to|at most|or more|indices below|numbers?) \S+ (is|are) accepted\b/i,
    only: 'strings',
    use: '"must be > 0, got −1"',
    bad: '-1; a number above 0 is needed',
    good: 'must be > 0, got −1',
  },
  {
    find: /(?<!there )\bis no (list|line|whole number|number|typed array|object|triangle|saved state|base64|hexadecimal|type|name)\b|\bthis is no \w+/i,
    use: '"is not a …", "must be a …"',
    bad: 'This is no object, and is no list of numbers.',
    good: 'This must be an object, and there is no line until it is set.',
  },
  {
    find: /\bthese bytes are no\b|\bbytes after the end\b/i,
    use: '"not a saved state of this version", "trailing bytes"',
    bad: 'These bytes are no saved state.',
    good: 'Not a saved state of this version.',
  },
  {
    find: /\btake (fewer|shorter|longer|larger|smaller|less) (pyramid|levels?|edges?|volumes?|ellipsoids?|points?)\b/i,
    use: '"use", "reduce", "increase"',
    bad: 'None fits: take fewer pyramid levels.',
    good: 'No bubble fits: reduce the pyramid levels. Long edges take longer.',
  },
  {
    find: /\bhow (far|strongly|loosely|often|much) (each|the|a|it|to) \w+ (reach|reaches|binds?|goes|may go|may move|is|are)\b/i,
    only: 'strings',
    use: 'name the quantity: "Width of the kernel", "Number of iterations"',
    bad: 'How far a vertex may go in one iteration',
    good: 'Largest displacement of a vertex in one iteration',
  },
  {
    find: /(?:^|[.;:] )(More|Much|Less) of it\b|\ba little of it\b/,
    use: '"Larger values …"',
    bad: 'More of it rounds off detail.',
    good: 'Larger values smooth detail.',
  },
  {
    find: /\bother people['’]s\b|\bof other people\b|\bof others['’]? (work)\b/i,
    use: '"third-party"',
    bad: 'Times other people’s software.',
    good: 'Times third-party software.',
  },
  {
    find: /\bnothing leaves (your|the|this) (machine|computer)\b/i,
    use: '"Your data never leave this machine."',
    bad: 'Nothing leaves your machine.',
    good: 'Your data never leave this machine.',
  },
  {
    find: /\bof your own data\b|\bliving surfaces?\b|\bgrow(s|n)? (living|closed|a|the)? ?(closed )?surfaces?( onto| out of| over)\b/i,
    use: '"fits a closed surface to"',
    bad: 'Grows closed surfaces out of volumes: living surfaces.',
    good: 'Fits closed surfaces to volumes. The surface grows where the image is bright.',
  },
  {
    find: /\btold apart\b|\btells? apart\b|\bcannot be told\b/i,
    use: '"distinguished", "is unknown"',
    bad: 'The walls are told apart.',
    good: 'The walls are distinguished.',
  },
  {
    find: /\b(a|an|each|one|per|every|of) frame and (a|an) half\b|\bin the mean\b|\bat the most\b|\bat the least\b/i,
    use: '"on average", "at most", "at least"',
    bad: 'Half a pixel in the mean, and 3 at the most.',
    good: 'Half a pixel on average, and at most 3.',
    except: [
      {
        find: /\bin the mean square\b|in the mean curvature/i,
        because: 'mean square and mean curvature are quantities',
        good: 'Errors in the mean square.',
      },
    ],
  },
];

/** Labels of the interface that are replaced as a whole. */
const LABELS = [
  ['Taken in', 'Duration'],
  ['Made in', 'Duration'],
  ['Keys', 'Keyboard shortcuts'],
  ['Distance of points, mean', 'Mean point-to-surface distance'],
].map(([bad, good]) => ({ find: new RegExp(`^${bad}$`), only: 'strings', use: good, bad, good }));

/** All rules, in the order in which they are tried. */
export const PHRASES = [...WORDS, ...SENTENCES, ...LABELS];
